// Values of more than 8 bits as the 256 grey levels that the stages work on.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace weft {

// Counts values to tell how many bits an image uses. Cameras of 10, 12 or 14 bits often leave the upper bits
// of 16 empty, and dark images those of any format: of its upper 8 bits few levels would be left.
class BitsInUse {
 public:
  void Add(uint16_t value) { ++counts_[Width(value)]; }
  // 8 to 16: the fewest that hold all values but one in 10,000. Those are hot pixels, and become white.
  int Count() const;

 private:
  static int Width(uint16_t value) { return value == 0 ? 0 : 32 - __builtin_clz(value); }

  std::array<uint64_t, 17> counts_{};  // by the bits that a value takes
};

// Rounded to 8 bits, so that the largest value of the bits in use becomes 255.
std::vector<uint8_t> ToEightBits(std::span<const uint16_t> values);

}  // namespace weft
