// Rows of cells along an edge of what is known. Beyond an edge, other print matches the next cell by chance
// in a tenth of the cases, and rarely for three cells side by side.
#pragma once

#include "pattern/surface/board_state.h"

namespace weft {

// Length of the shortest row or column of known cells that a cell is in at an edge. The cell has a known
// neighbour on one side, none on the other, and the row runs along that edge. kLongestRun, too, where it
// is longer; kNoEdge for a cell at no edge.
inline constexpr int kLongestRun = 6, kNoEdge = 7;
int RunAtEdge(const BoardState& state, int row, int col);

}  // namespace weft
