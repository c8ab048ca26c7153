// Whether a template's map lies elsewhere on the board than the cloth that was filmed.
#pragma once

#include <optional>

#include "alignment/template.h"
#include "pattern/board/board.h"
#include "triangulation/cloud.h"

namespace weft {

// How a map fits after all: all of it turned by half a turn on the board, or moved.
struct MapPlace {
  bool half_turn = false;
  int rows = 0, cols = 0;  // by which its cells move
  // Cells that were triangulated: all, those that no vertex has, and those that none has in the other place.
  int cells = 0, outside = 0, outside_there = 0;
};

// Meshes and maps that are consistent in themselves say nothing of it: rows and columns that count from 1, or
// from the far corner of the board, lie on it as right ones do. What was filmed does: cells at the borders of
// panels that no vertex has. Nothing where the map fits best as it is, or too little was seen.
std::optional<MapPlace> FindOtherPlace(const Template& garment, const Board& board, const Cloud& cloud);

}  // namespace weft
