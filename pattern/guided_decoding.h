// Cells of one view that are looked for where they must be, once the surface is known (a second look).
#pragma once

#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/frame.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/observation.h"

namespace weft {

// Where a board cell must be in a view.
struct PredictedCell {
  int row = 0;
  int col = 0;
  CellFrame frame;
  NeighborWeights in_sight{};  // 3x3, row by row: 1 where that cell is in sight beside this one, else 0
  float sigma_px = 0;          // of the place, per axis; of known cells that of the observation
};

struct GuidedOptions {
  // Share of the variance within the cells in sight that the print has to explain, and by how much it has to
  // lead every other place of the board within `rival_cells` rows and columns. Where the place is known well,
  // nothing but the cell can be there, and a cell that is alone in sight has rivals of its own colour.
  float min_explained = 0.4f;
  float min_lead = -0.1f;
  int rival_cells = 2;
  // The same where the place is known less well than `vague_px`, or a tenth of a cell.
  float vague_px = 0.5f;
  float min_explained_vague = 0.6f;
  float min_lead_vague = 0.2f;
  // Of the variance within the cell alone: its neighbours may be in sight where it is covered.
  float min_explained_alone = 0.15f;
  // How much better the expected ink must fit than any other; as GrowthOptions::min_ink_lead.
  float min_ink_lead = 0.3f;
  // Largest distance from the predicted place, in its standard deviations (that of the fit added), and in
  // cells. Where sigma_px is large, starts half a cell apart within two of them are tried, too.
  float max_move_sigmas = 4;
  float max_move_cells = 0.6f;
  // The image itself must fix the place this well; what it leaves open the prediction would answer.
  float max_sigma_cells = 0.1f;
  // Least size of a cell in the image: its area, and its area over its longer edge.
  float min_area_px = 4;
  float min_width_px = 1.2f;
  int iterations = 6;

  absl::Status Validate() const;
};

enum class GuidedVerdict : uint8_t {
  kFound,
  kTooSmall,
  kNoFit,
  kCovered,
  kOtherInk,
  kMoved,
  kVague,
  kRival,
  kTaken
};
inline constexpr int kGuidedVerdicts = 9;
std::string_view GuidedVerdictName(GuidedVerdict verdict);  // "found", "too_small" ...

// What became of a predicted cell.
struct GuidedCell {
  GuidedVerdict verdict = GuidedVerdict::kTooSmall;
  CellFit fit;
  float explained_alone = 0;
  float lead = 0;         // over the best rival
  float sigma_px = 0;     // of the place by the image alone, per axis
  float miss_sigmas = 0;  // distance from the prediction
};

struct GuidedResult {
  std::vector<GuidedCell> cells;          // as `wanted`
  std::vector<Observation> observations;  // found cells, and corners between four known or found ones
};

// Looks for the cells `wanted` (no cell twice, none of `known`). `known`: cells of the view that were decoded
// before; they tell how the print looks in this view, and keep their places. A cell is found when the print
// explains its image at the predicted place, better than its ink or the print of other places would, and
// nobody is there already. Corners are those that at least one found cell touches. With fewer than 20 known
// cells nothing is looked for (verdict kNoFit). Errors as DecodeView. Single-threaded and deterministic.
absl::StatusOr<GuidedResult> DecodePredicted(const Frame& frame, const Board& board,
                                             const std::vector<PredictedCell>& known,
                                             const std::vector<PredictedCell>& wanted,
                                             const GuidedOptions& options);

}  // namespace weft
