// Boards that several tests decode.
#pragma once

#include "pattern/board/board.h"
#include "pattern/board/board_index.h"

namespace weft {

// All cells red.
inline Board PlainBoard(int rows, int cols) {
  Board board;
  board.rows = rows;
  board.cols = cols;
  board.cells.assign(static_cast<size_t>(rows) * cols, CellColor::kRed);
  return board;
}

// The board of photographs that are decoded as a whole.
inline const BoardIndex& TestBoard() {
  static const BoardIndex index = *BoardIndex::Build(*GenerateBoard(60, 70, 3.0, 5));
  return index;
}

}  // namespace weft
