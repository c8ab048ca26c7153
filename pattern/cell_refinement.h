// A second look at grown cells, now that their neighbours are known.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "pattern/board_growth.h"

namespace weft {

struct CellRefinementOptions {
  // A cell whose identity and place are less certain is dropped.
  float min_confidence = 0.975f;
  // Fewer connected cells than this may be chance, in a view of up to a thousand; larger ones ask for more.
  int min_component = 5;

  absl::Status Validate() const;
};

// Fits the centres of neighbouring cells together, drops cells that are too uncertain and those that are left
// in small groups, and fits the rest once more. Cells whose centres then lie outside the image are dropped.
// Order is kept.
void RefineCells(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                 const CellRefinementOptions& options, std::vector<GrownCell>* cells);

}  // namespace weft
