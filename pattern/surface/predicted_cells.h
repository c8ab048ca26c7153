// Single cells that are looked for where they must be, once the surface is known from other views.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "pattern/fit/cell_check.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"

namespace weft {

struct GuidedOptions {
  // Share of the variance within the visible cells that the print has to explain, and its lead over every
  // other part of the board within two rows and columns. Where the position is known well, nothing but the
  // cell can be there, and a cell that is alone in sight has rivals of its own colour.
  float min_explained = 0.4f;
  float min_lead = -0.1f;
  // The same where the position is known less well than half a pixel, or a tenth of a cell.
  float min_explained_vague = 0.6f;
  float min_lead_vague = 0.2f;
  // Largest distance from the predicted position, in its standard deviations (that of the fit added), and in
  // cells. Where sigma_px is large, starts half a cell apart within two of them are tried, too.
  float max_move_sigmas = 4;
  float max_move_cells = 0.6f;
  // The image itself must fix the position this well; what it leaves open the prediction would answer.
  float max_sigma_cells = 0.1f;

  absl::Status Validate() const;
};

// Looks for `predicted` cells (none twice): a cell is found when the print explains its image at the
// predicted position, better than its ink or the print of other parts of the board would, and nobody is there
// already. Cells found are added to `state`, which is sorted then; cells that were there stay. Returns for
// each predicted cell why it was not found, or nothing.
std::vector<std::optional<WhyMissing>> FindPredicted(const CellFitter& fitter,
                                                     const std::vector<PredictedCell>& predicted,
                                                     const GuidedOptions& options, BoardState* state);

}  // namespace weft
