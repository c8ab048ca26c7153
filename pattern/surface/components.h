// Connected components of a view's cells.
#pragma once

#include "pattern/surface/board_state.h"

namespace weft {

// Removes cells of 4-connected components that chance may have made: of fewer than `least_of_few` cells in a
// view of up to a thousand, and of more in larger views.
void DropSmallComponents(int least_of_few, BoardState* state);

}  // namespace weft
