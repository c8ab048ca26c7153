// When the frames of a take were taken, as far as it tells.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace weft {

struct TakeTimes {
  double fps = 0;                  // 0: nothing tells
  std::string source;              // of fps: "the take's times"
  std::vector<int64_t> positions;  // of the dump's frames; empty: they follow each other
};

// From the index of a recorded take; of a folder of pictures from <truth>/pictures.csv, where there is one.
TakeTimes TimesOfTake(const std::string& dump, const std::string& truth);

// The rate as people name it: whole frames a second, or 1000/1001 of them as in television, where it differs
// by no more than the rounding of times to nanoseconds. For files of other programs.
double NominalRate(double fps);

}  // namespace weft
