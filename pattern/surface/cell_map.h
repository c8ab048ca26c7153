// Cells by their place on the board.
#pragma once

#include "pattern/image/pixel_allocator.h"
#include "pattern/surface/board_growth.h"

namespace weft {

class CellMap {
 public:
  CellMap(const Board& board, const GrownCells& cells)
      : columns_(board.cols + 2 * kBorder),
        index_(static_cast<size_t>(columns_) * (board.rows + 2 * kBorder), -1) {
    for (size_t k = 0; k < cells.size(); ++k) index_[Place(cells[k].row, cells[k].col)] = static_cast<int>(k);
  }

  // Index of the cell, -1 where there is none; at most two rows or columns off the board.
  int At(int row, int col) const { return index_[Place(row, col)]; }

 private:
  static constexpr int kBorder = 2;
  size_t Place(int row, int col) const {
    return static_cast<size_t>(row + kBorder) * columns_ + col + kBorder;
  }

  int columns_;
  PixelVector<int> index_;
};

}  // namespace weft
