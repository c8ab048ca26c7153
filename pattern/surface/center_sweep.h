// The centres of all cells of a view, refined together.
#pragma once

#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"

namespace weft {

// One symmetric Gauss-Seidel sweep, in the order of the cells and back, of a nonlinear least-squares problem
// over all centres. Data: photometric residual of the print, bilinear between the centres, read once. Prior:
// Cauchy-robust second, fourth and mixed differences of the grid of centres, tighter along a cell's long
// image axis, since out-of-plane bending moves centres across it. Where neighbours are hidden, the print
// there is as narrow as explains the image best. Takes over what the fit says about the image before the
// moves; sigma_px takes the cells around as known. Of a pose only the centre changes. Converges in about two
// sweeps.

// Leaves cells as they are that are scored (BoardState::IsScored).
void SweepUnscored(const CellFitter& fitter, BoardState* state);

// Leaves cells as they are that the sweep before moved by less than `least_move_cells`.
void SweepUnsettled(const CellFitter& fitter, float least_move_cells, BoardState* state);

}  // namespace weft
