// Numbers for 3x3 windows of colours.
#pragma once

#include <array>
#include <cstdint>

#include "pattern/board/board.h"

namespace weft {

// Colours of a 3x3 window, row by row.
using Window = std::array<CellColor, 9>;

// 7^9 windows exist.
inline constexpr uint32_t kWindowCodes = 40353607;

// The window as a base-7 number, 0 to kWindowCodes - 1; the first cell is the most significant digit.
inline uint32_t WindowCode(const Window& window) {
  uint32_t code = 0;
  for (const CellColor color : window) code = code * kCellColors + static_cast<uint32_t>(color);
  return code;
}

// The window after a quarter turn: cell (i, j) of the result is cell (j, 2 - i) of the argument.
inline Window QuarterTurn(const Window& window) {
  Window out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[3 * i + j] = window[3 * j + 2 - i];
  }
  return out;
}

// Codes of the window after 0, 1, 2 and 3 quarter turns.
inline std::array<uint32_t, 4> RotatedCodes(Window window) {
  std::array<uint32_t, 4> codes;
  for (uint32_t& code : codes) {
    code = WindowCode(window);
    window = QuarterTurn(window);
  }
  return codes;
}

// The 3x3 window of a board whose upper left cell is (row, col); it must lie on the board.
inline Window BoardWindow(const Board& board, int row, int col) {
  Window window;
  for (int i = 0; i < 9; ++i) window[i] = board.at(row + i / 3, col + i % 3);
  return window;
}

}  // namespace weft
