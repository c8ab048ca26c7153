// Numbers in names of frames.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace weft {

// The number of each name as text, "12" or "12.5", of names that differ in it alone; with what stands before
// and behind it. Behind text, a point begins a fraction where all names have as many digits behind it, three
// or more, and differ before it; or where nine digits are before it. Nothing where names differ otherwise.
struct NumbersInNames {
  std::string before, after;
  std::vector<std::string> numbers;
};
std::optional<NumbersInNames> FindNumbers(const std::vector<std::string>& names);

// Of names that differ in one number alone, "0007", "frame_12" or "0012.rgb"; a fraction is scaled to whole
// numbers, so that "0.5" and "1.25" are 50 and 125. Nothing where names differ otherwise, or where a number
// is beyond 64 bits.
std::optional<std::vector<int64_t>> FrameNumbers(const std::vector<std::string>& names);

// How far frames lie apart, in steps from one to the next as they usually are.
class FrameSteps {
 public:
  // Names in order of time, clocks (ClocksInNames) or numbers. Where they are no rising ones, each step is
  // one.
  explicit FrameSteps(const std::vector<std::string>& names);

  // From one position to another, rounded: 1 for neighbours, 8 from 2 to 10 among 0, 1, 2, 10, 11.
  int64_t Between(size_t from, size_t to) const;

 private:
  std::vector<int64_t> numbers_;  // empty: by position
  int64_t usual_ = 1;
};

}  // namespace weft
