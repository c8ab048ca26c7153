// The centres of all cells of a view, fitted together.
#pragma once

#include <vector>

#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_growth.h"

namespace weft {

// Moves the centres of all cells to where the image and the cells around want them: Gauss-Seidel, once in the
// order given with the image, and once back with what the image said then, on the least squares of a print
// that is interpolated bilinearly between the centres, with a robust prior on how rows, columns and squares
// of centres bend. Bending moves cloth out of its surface, so the prior is stricter along the longer axis of
// a cell in the image than across it. Takes over what the fit says about the image before the moves; sigma_px
// takes the cells around as known. Of a frame only the centre changes. Two calls come close to the end; cells
// that the call before moved by less than `least_move_cells`, and those that `stays` [cells] marks, are left
// as they are.
void SweepCenters(const CellFitter& fitter, const Board& board, float least_move_cells,
                  const std::vector<bool>& stays, GrownCells* cells);

}  // namespace weft
