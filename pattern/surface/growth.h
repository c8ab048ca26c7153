// From a few cells whose position on the board is known to all that can be seen.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/surface/board_state.h"

namespace weft {

struct GrowthOptions {
  FitLimits fit;
  // What is explained by this share is clear, and comes before all that is not.
  float clearly_explained = 0.6f;
  // Behind occluders, a cell is looked for where this many of the eight around it are known.
  int min_known_at_boundary = 4;

  absl::Status Validate() const;
};

// What one growth does beyond following the print.
struct GrowthPolicy {
  // Starts from the seeds, beside the cells that are known.
  bool from_seeds = false;
  // Cells at the boundary of the known part are fitted again as seeds, with all neighbours in full weight.
  // They were fitted with fewer neighbours, and a better shape reaches farther into a fold.
  bool refits_boundary = false;
  // Fits of cells beside known ones take one step, and stay near the shape that the known one has. In a fold
  // half of what is around a cell is other cloth, and further steps give in to it.
  bool in_one_step = false;
  // Asks for further seeds once all that is clear has been taken.
  bool with_isolated = false;
  // Known cells look for those across a corner, too.
  bool from_diagonals = false;
  // Known cells look for others only where something was added or removed since BoardState::MarkScored.
  bool near_changes = false;
  // Parts of the print in front of a cell do not count against it; else the cloth may turn away behind a
  // neighbour.
  bool behind_occluders = false;
};
inline constexpr GrowthPolicy kFromSeeds{.from_seeds = true},
    kWithIsolated{
        .refits_boundary = true, .in_one_step = true, .with_isolated = true, .from_diagonals = true},
    kBehindOccluders{.in_one_step = true, .behind_occluders = true},
    kNearChanges{.in_one_step = true, .from_diagonals = true, .near_changes = true};

// Where growths start beside the cells that are known; see GrowthPolicy.
struct GrowthSeeds {
  std::vector<PlacedCell> first;                                       // from pieces of lattice
  std::function<std::vector<PlacedCell>(const BoardState&)> isolated;  // may be empty
};

// Follows the print from the seeds, and from the cells of `state`, cell by cell, the best explained (to 1 %)
// first: predicts the next cell from a known neighbour, fits it, and takes it when the image shows the
// colours that the board has there. A board cell is taken once, and so is a position in the image. Adds the
// cells to `state`, which is sorted then; cells that were there stay as they are.
void Grow(const CellFitter& fitter, const GrowthOptions& options, const GrowthPolicy& policy,
          const GrowthSeeds& seeds, BoardState* state);

}  // namespace weft
