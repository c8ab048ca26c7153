// Boards of garments that are filmed together.
#pragma once

#include <utility>
#include <vector>

#include "pattern/board/board_generation.h"

namespace weft {

inline Board BoardApartFrom(std::vector<Board> others, int rows, int cols, uint64_t seed) {
  BoardGenerationOptions options;
  options.rows = rows;
  options.cols = cols;
  options.seed = seed;
  options.apart_from = std::move(others);
  return *GenerateBoard(options);
}

}  // namespace weft
