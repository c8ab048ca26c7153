// SMPTE timecode as text and as a time of day.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace weft {

inline constexpr int kMostTimecodeFps = 240;

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
  // How long it takes until the same label comes again: 86,486.4 s where 29.97 frames a second drop none.
  double Day_s() const;
};

// Rates of SMPTE ST 12-1: N frames a second, or N * 1000 / 1001. They are 0.1 % apart.
struct TimecodeRate {
  int nominal_fps = 0;
  bool is_slow = false;
  double fps() const { return is_slow ? nominal_fps * 1000.0 / 1001 : nominal_fps; }
};

// Parts by which a rate may be off: 23.98 is 0.0002 off 23.976, and the rates of a number are 0.001 apart;
// what is meant exactly is written as a fraction, or with three digits (59.94).
inline constexpr double kWrittenShort = 0.0004, kWrittenExactly = 2e-6;
// The rate that `fps` is within this part; nothing for others.
std::optional<TimecodeRate> StandardRate(double fps, double within = kWrittenShort);

// "HH:MM:SS:FF"; a semicolon (or a point or comma) before the frames: numbers are dropped. `fps` of the
// timecode, which must be within 0.5 % of a whole number. Hours beyond a day and times before midnight
// ("-00:00:01:00") are those of another day. InvalidArgument says what is wrong.
absl::StatusOr<Timecode> ParseTimecode(std::string_view text, double fps);
std::string TimecodeText(const Timecode& timecode);

// The timecode of the frame with this number, rate and dropping those of `like`; wraps at midnight.
Timecode TimecodeOf(int64_t number, const Timecode& like);

}  // namespace weft
