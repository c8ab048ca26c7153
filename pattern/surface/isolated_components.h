// Isolated components: parts of the print beyond a fold or a dark strip, too small or too faint for a
// lattice.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "pattern/fit/cell_fitter.h"
#include "pattern/image/ink_model.h"
#include "pattern/seeds/keypoints.h"
#include "pattern/surface/board_state.h"

namespace weft {

struct IsolatedOptions {
  // Farthest board cell that a blob may be, in rows and columns from a known cell near it.
  int reach_cells = 10;
  // Least evidence of the colours at a blob and around it, in nats; as PatchDecodeOptions::min_evidence.
  float min_evidence = 3.0f;

  absl::Status Validate() const;
};

// Reads blobs near known cells as one of the missing board cells around those. The print is expected to
// continue as at the known cell, with an unknown part of it hidden in between. A seed here is no proof:
// growth has to find its neighbours.
std::vector<PlacedCell> FindIsolatedSeeds(const CellFitter& fitter, const InkModel& inks,
                                          const BoardState& state, const std::vector<LooseBlob>& blobs,
                                          const IsolatedOptions& options);

}  // namespace weft
