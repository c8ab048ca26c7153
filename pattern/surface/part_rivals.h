// Where the prints of two garments meet in a view, a cell may have been read as one of the wrong garment.
#pragma once

#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"

namespace weft {

// Removes cells of one part of a joint board where another part, whose cells around that place are known,
// goes on and explains the image as well; better, for cells in a long row. Nothing happens on boards of one
// part. Returns how many are gone.
int EvictPartRivals(const CellFitter& fitter, BoardState* state);

}  // namespace weft
