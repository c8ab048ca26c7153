// A synthetic take as an image-folder dump with ground truth.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "simulation/synthetic_take.h"

namespace weft {

// What was written, for the user.
struct TakeSummary {
  int frames = 0;
  int cameras = 0;
  int cells = 0;                  // of the garment
  double median_pitch_px = 0;     // of the scoreable cells, all views
  double scoreable_per_view = 0;  // cells, in the mean
};

// Writes <out>/<frame>/<camera>.png, rig.json, board.json and board.png, template/ and
// truth/<frame>/{mesh.ply,<camera>.csv}. The folder appears under its name when it is complete; until then it
// is <out>.partial-<process id>. `on_view` (may be empty) is called after each view, from any thread.
// AlreadyExists when <out> exists and is not an empty folder; Cancelled, with nothing left behind, when
// `stop` is requested. Parallel over views in the calling thread's TBB arena; the same bytes at any thread
// count.
absl::StatusOr<TakeSummary> WriteSyntheticTake(const SyntheticTake& take, const std::string& out,
                                               const std::function<void()>& on_view = {},
                                               const std::stop_token& stop = {});

}  // namespace weft
