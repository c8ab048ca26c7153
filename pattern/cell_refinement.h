// A second look at grown cells, now that their neighbours are known.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "pattern/board_growth.h"

namespace weft {

struct CellRefinementOptions {
  // A cell whose identity and place are less certain is dropped.
  float min_confidence = 0.975f;
  // Fewer connected cells than this may be chance.
  int min_component = 5;

  absl::Status Validate() const;
};

// Drops cells that are too uncertain and those that are left in small groups, then sharpens the places of the
// rest by their neighbours'. Order is kept.
void RefineCells(const Board& board, int width_px, int height_px, const CellRefinementOptions& options,
                 std::vector<GrownCell>* cells);

}  // namespace weft
