// A set of 3x3 windows of colours, with their rotations.
#pragma once

#include <cstdint>
#include <vector>

#include "pattern/board/window_code.h"

namespace weft {

// The window seen in a mirror: left and right exchanged.
inline Window Mirrored(const Window& window) {
  Window out;
  for (int i = 0; i < 9; ++i) out[i] = window[i / 3 * 3 + 2 - i % 3];
  return out;
}

inline bool EqualsItsRotation(const std::array<uint32_t, 4>& codes) {
  return codes[0] == codes[1] || codes[0] == codes[2];
}

// One bit per code, 5 MB.
class CodeSet {
 public:
  CodeSet() : bits_(kWindowCodes / 64 + 1, 0) {}

  bool Contains(uint32_t code) const { return bits_[code / 64] >> (code % 64) & 1; }
  void Add(const std::array<uint32_t, 4>& codes) {
    for (const uint32_t code : codes) bits_[code / 64] |= uint64_t{1} << (code % 64);
  }
  void Remove(const std::array<uint32_t, 4>& codes) {
    for (const uint32_t code : codes) bits_[code / 64] &= ~(uint64_t{1} << (code % 64));
  }

  // Codes of the set that differ from this one in the given cell alone (0 to 8, row by row).
  int CountOneAway(const Window& window, int cell) const {
    uint32_t place = 1;
    for (int i = 8; i > cell; --i) place *= kCellColors;
    return CountInPlace(WindowCode(window), place, static_cast<uint32_t>(window[cell]));
  }
  // The same for any one cell.
  int CountOneAway(const Window& window) const {
    const uint32_t code = WindowCode(window);
    uint32_t place = 1;
    int count = 0;
    for (int i = 8; i >= 0; --i, place *= kCellColors)
      count += CountInPlace(code, place, static_cast<uint32_t>(window[i]));
    return count;
  }

 private:
  int CountInPlace(uint32_t code, uint32_t place, uint32_t own) const {
    int count = 0;
    uint32_t other = code - own * place;
    for (uint32_t color = 0; color < kCellColors; ++color, other += place)
      count += color != own && Contains(other);
    return count;
  }

  std::vector<uint64_t> bits_;
};

}  // namespace weft
