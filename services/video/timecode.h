// SMPTE timecode as text and as a time of day.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace weft {

inline constexpr double kDay_s = 86400;

// A frame of a day. `nominal_fps` frames are counted a second (24, 25, 30, 48, 50, 60, ...); `fps` is what
// they really are: 29.97 counts 30. With `drops` two numbers of 30 (four of 60) are left out each minute but
// every tenth.
struct Timecode {
  int hours = 0, minutes = 0, seconds = 0, frames = 0;
  bool drops = false;
  int nominal_fps = 25;
  double fps = 25;

  // Frames since midnight, and the time of day that they take at `fps`.
  int64_t Number() const;
  double Seconds() const { return static_cast<double>(Number()) / fps; }
};

// "HH:MM:SS:FF"; a semicolon (or a point) before the frames: numbers are dropped. `fps` of the film, which
// must be within 0.5 % of a whole number. InvalidArgument says what is wrong.
absl::StatusOr<Timecode> ParseTimecode(std::string_view text, double fps);
std::string TimecodeText(const Timecode& timecode);

// The timecode of the frame with this number, rate and dropping those of `like`; wraps at midnight.
Timecode TimecodeOf(int64_t number, const Timecode& like);

}  // namespace weft
