// Look-up of windows of six cells: what narrow strips of a board show.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pattern/board/board.h"

namespace weft {

// A lattice on the board with its cell (0, 0) at board cell number `cell` (row * cols + col); quarter turns
// as in BoardPose.
struct PackedPose {
  uint32_t cell_and_turns = 0;

  PackedPose() = default;
  PackedPose(int cell, int quarter_turns)
      : cell_and_turns(static_cast<uint32_t>(cell) << 2 | static_cast<uint32_t>(quarter_turns)) {}
  int cell() const { return static_cast<int>(cell_and_turns >> 2); }
  int quarter_turns() const { return static_cast<int>(cell_and_turns & 3); }
};

// All places of each window of six cells, 2 rows and 3 columns or 6 in a row, in the four orientations. Six
// colours do not name one place: a board of 270,000 cells shows most windows nine times. Windows that follow
// each other do.
class StripIndex {
 public:
  enum class Shape { k2x3, k1x6 };
  StripIndex(const Board& board, Shape shape);

  // Row by row, the first cell is the most significant digit.
  static constexpr uint32_t Code(const std::array<int, 6>& colors) {
    uint32_t code = 0;
    for (const int color : colors) code = code * kCellColors + static_cast<uint32_t>(color);
    return code;
  }

  // Poses under which lattice cells (0..1, 0..2), or (0, 0..5), have these colours, in the order of the
  // board.
  std::span<const PackedPose> Find(uint32_t code) const {
    return {poses_.data() + first_[code], poses_.data() + first_[code + 1]};
  }

 private:
  std::vector<uint32_t> first_;  // by code, and one more
  std::vector<PackedPose> poses_;
};

}  // namespace weft
