// Clocks in names of frames: "101502033" is 10:15:02.033, "2021-06-16_10-15-02.033" has the day as well.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace weft {

struct NameClocks {
  std::vector<int64_t> times_ns;  // since midnight; with a day since 1970, as if the clock were UTC's; rising
  int64_t unit_ns = 0;            // of the last digit
  int timecode_fps = 0;           // frames in a second of a timecode; 0: no timecode
  bool has_day = false;
};

// Names that differ in one clock of 24 hours alone: hours, minutes, seconds, and 0 or 3 to 9 digits of a
// fraction, as many in each name. Marks may stand between all of them or none, and a day before them. Digits
// without marks have 0, 3, 6 or 9 of a fraction; with 3, zeros before the first hour or minute may be
// missing. Two digits are a timecode's frames, of which a second has as many as names show: 24, 25, 30, 48,
// 50 or 60. Nothing where names are otherwise, a minute has 60 seconds, or times do not rise.
std::optional<NameClocks> ReadNameClocks(const std::vector<std::string>& names);

// The same where names cannot be numbers of frames, since
// - they go on over the end of a minute, at which numbers jump by 40 seconds' worth, or with a timecode over
//   that of a second; or
// - they have a fraction and steps of 2 ms to 1.1 s, and a day, an hour that is not 0, or marks and seconds
//   that differ.
std::optional<NameClocks> ClocksInNames(const std::vector<std::string>& names);

}  // namespace weft
