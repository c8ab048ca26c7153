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
  // Share of the variance within the cells in sight that the print has to explain, and by how much it has to
  // lead every other part of the board within `rival_cells` rows and columns. Where the position is known
  // well, nothing but the cell can be there, and a cell that is alone in sight has rivals of its own colour.
  float min_explained = 0.4f;
  float min_lead = -0.1f;
  int rival_cells = 2;
  // The same where the position is known less well than `vague_px`, or a tenth of a cell.
  float vague_px = 0.5f;
  float min_explained_vague = 0.6f;
  float min_lead_vague = 0.2f;
  // Of the variance within the cell alone: its neighbours may be in sight where it is covered.
  float min_explained_alone = 0.15f;
  // How much better the expected ink must fit than any other; as GrowthOptions::min_ink_lead.
  float min_ink_lead = 0.3f;
  // Largest distance from the predicted position, in its standard deviations (that of the fit added), and in
  // cells. Where sigma_px is large, starts half a cell apart within two of them are tried, too.
  float max_move_sigmas = 4;
  float max_move_cells = 0.6f;
  // The image itself must fix the position this well; what it leaves open the prediction would answer.
  float max_sigma_cells = 0.1f;
  // Least size of a cell in the image: its area, and its area over its longer edge.
  float min_area_px = 4;
  float min_width_px = 1.2f;
  int iterations = 6;

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
