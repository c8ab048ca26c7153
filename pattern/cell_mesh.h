// The centres of all cells of a view, fitted together.
#pragma once

#include <vector>

#include "pattern/board_growth.h"
#include "pattern/cell_fitter.h"

namespace weft {

// Moves every cell once to where the image and the cells around want it, in the order given (Gauss-Seidel on
// the least squares of a print that is interpolated bilinearly between the centres, with a robust prior on
// how the rows and columns of centres bend); and takes over what the fit says about the image there. Of a
// frame only the centre changes. Two sweeps come close to the end; cells that the fit before moved by less
// than `least_move_cells`, and those that `stays` [cells] marks, are left as they are.
void SweepCenters(const CellFitter& fitter, const Board& board, float least_move_cells,
                  const std::vector<bool>& stays, GrownCells* cells);

}  // namespace weft
