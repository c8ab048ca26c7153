// Connected components of a view's cells.
#pragma once

#include "pattern/surface/board_state.h"

namespace weft {

// Removes cells of 4-connected components that chance may have made: of fewer than `least_of_few` cells where
// up to a thousand were `searched`, and of more where there was more to search.
void DropSmallComponents(int least_of_few, size_t searched, BoardState* state);

// Cells of the largest 4-connected component; 0 where there are no cells.
int LargestComponent(const BoardState& state);

}  // namespace weft
