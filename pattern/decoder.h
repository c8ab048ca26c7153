// Decoding of one view: from pixels to board nodes.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "pattern/board/board_index.h"
#include "pattern/fit/cell_check.h"
#include "pattern/observation.h"
#include "pattern/seeds/keypoints.h"
#include "pattern/seeds/lattice.h"
#include "pattern/seeds/patch_decoder.h"
#include "pattern/surface/growth.h"
#include "pattern/surface/isolated_components.h"

namespace weft {

// Which cells stay, by their confidence.
struct ConfidenceOptions {
  // Before growth goes on, cells less certain than this make room.
  float min_to_grow = 0.85f;
  // The boundary is looked at again from cells that are as certain as this; others make room there.
  float min_at_boundary = 0.95f;
  // Down to here, cells still connect others and help to place them, before they are dropped.
  float min_to_help = 0.92f;
  // A cell whose identity and position are less certain is dropped in the end. In version 2, 0.98 left
  // fewer wrong cells than version 1 had, at more recall; 0.975 had more of both. accuracy_decode on the
  // takes of docs/decoding-accuracy.md, November 2026.
  float min_to_stay = 0.98f;
  // Fewer connected cells than this may be chance where a view shows up to a thousand cells of any board;
  // where it shows more, larger components may be, too.
  int min_component = 5;

  absl::Status Validate() const;
};

// Options of every step; nested structs belong to the headers of the steps.
struct DecodeOptions {
  // Halvings of the image that are searched for cells: level k finds pitches of 3 to 6.5 px times 2^k.
  int levels = 3;
  // Whether corners are reported beside centres.
  bool corners = true;
  // Whether the result explains itself beyond the patches' reports.
  bool explain = false;
  KeypointOptions keypoints;
  LatticeOptions lattice;
  PatchDecodeOptions patches;
  GrowthOptions growth;
  IsolatedOptions isolated;
  ConfidenceOptions confidence;

  absl::Status Validate() const;
};

// A connected piece of lattice, and what became of it.
struct PatchReport {
  int nodes = 0;
  bool accepted = false;
  std::string reason;  // for rejected ones: "mirrored", "no margin over the runner-up" ...
  double x_min_px = 0, y_min_px = 0, x_max_px = 0, y_max_px = 0;
  double margin = 0;  // log likelihood of the best pose minus the runner-up's
};

// Processor time. Reading is demosaicing and repacking.
struct DecodeTimings {
  double read_ms = 0, lattice_ms = 0, colors_ms = 0, growth_ms = 0, refinement_ms = 0;
};

// What a picture of a decoding shows beside observations and patches.
struct DecodeExplanation {
  std::vector<int> groups;           // [centers], cells that grew from one piece of lattice have one number
  std::vector<MissingCell> missing;  // where growth along the board stopped
  std::vector<LooseBlob> loose;      // blobs that are in no patch
};

// Observations ordered by kind, row, column; a node occurs at most once.
struct DecodeResult {
  std::vector<Observation> observations;
  std::vector<PatchReport> patches;
  // Between the black lines and the brightest ink, as the camera or the file tells them apart, at most 255.
  // The median over the cells; 0 of none.
  float grey_levels = 0;
  DecodeTimings timings;
  DecodeExplanation explanation;  // empty unless asked for
};

// Finds the nodes of the board in one view. Grey frames are InvalidArgument: colours carry the code.
// Single-threaded and deterministic; call it for several views in parallel. For a second pass over the view,
// see view_decoder.h.
absl::StatusOr<DecodeResult> DecodeView(const Frame& frame, const BoardIndex& board,
                                        const DecodeOptions& options);

}  // namespace weft
