// Decoding of one view: from pixels to board nodes.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/frame.h"
#include "pattern/board_index.h"
#include "pattern/observation.h"

namespace weft {

// Options of every step; nested structs belong to the headers of the steps.
struct DecodeOptions {};

// A connected piece of lattice, and what became of it.
struct PatchReport {
  int nodes = 0;
  bool accepted = false;
  std::string reason;  // for rejected ones: "too small", "no margin over the runner-up", "mirrored" ...
  double x_min_px = 0, y_min_px = 0, x_max_px = 0, y_max_px = 0;
  double margin = 0;  // log likelihood of the best pose minus the runner-up's
};

struct DecodeTimings {
  double detect_ms = 0, lattice_ms = 0, colors_ms = 0, decode_ms = 0;
};

// Observations ordered by kind, row, column; a node occurs at most once.
struct DecodeResult {
  std::vector<Observation> observations;
  std::vector<PatchReport> patches;
  DecodeTimings timings;
};

// Finds the nodes of the board in one view. Grey frames are InvalidArgument: colours carry the code.
// Single-threaded and deterministic; call it for several views in parallel.
absl::StatusOr<DecodeResult> DecodeView(const Frame& frame, const BoardIndex& board,
                                        const DecodeOptions& options);

}  // namespace weft
