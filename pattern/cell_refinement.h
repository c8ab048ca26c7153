// A second look at grown cells, now that the surface around each is known.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "pattern/board_growth.h"
#include "pattern/cell_fitter.h"

namespace weft {

struct CellRefinementOptions {
  // Half the side of the window that places a cell, in cells.
  float reach = 0.8f;
  // A cell that would move farther, in cells, stays where it was.
  float max_move_cells = 0.3f;
  // A cell has to lie this near to where its neighbours expect it, in cells.
  float max_misfit_cells = 0.3f;
  // A cell whose identity and place are less certain is dropped.
  float min_confidence = 0.98f;
  // Fewer connected cells than this may be chance.
  int min_component = 5;

  absl::Status Validate() const;
};

// Places every cell again in a window that bends as its neighbours say, then drops those that contradict
// their neighbours and those that are left in small groups. Order is kept.
void RefineCells(const CellFitter& fitter, const Board& board, const CellRefinementOptions& options,
                 std::vector<GrownCell>* cells);

}  // namespace weft
