// Parts of the print beyond a fold or a dark strip that are too small or too faint for a lattice.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/image/color_image.h"
#include "pattern/image/ink_model.h"
#include "pattern/seeds/keypoints.h"
#include "pattern/surface/board_growth.h"

namespace weft {

struct IslandOptions {
  // Farthest board cell that a spot may be, in rows and columns from a known cell near it.
  int reach_cells = 10;
  // Least evidence of the colours at a spot and around it, in nats; as PatchDecodeOptions::min_evidence.
  float min_evidence = 3.0f;
  // Share of the variance that the print has to explain there, and the least lead of its ink; as in
  // GrowthOptions.
  float min_explained = 0.6f;
  float min_ink_lead = 0.3f;

  absl::Status Validate() const;
};

// A spot that belongs to no known cell.
struct LooseSpot {
  float x_px = 0, y_px = 0;  // in the full image
  int level = 0;             // of the pyramid, where it was found
};

// Reads spots near known cells as one of the board cells around those that are still missing: the print is
// expected to go on as it does at the known cell, with an unknown part of it hidden in between. A seed here
// is no proof: growth has to find its neighbours. `pyramid` as for CellFitter.
std::vector<GrowthSeed> FindIslandSeeds(const CellFitter& fitter, const std::vector<ColorImage>& pyramid,
                                        const Board& board, const InkModel& inks, const GrownCells& known,
                                        const std::vector<LooseSpot>& spots, const IslandOptions& options);

}  // namespace weft
