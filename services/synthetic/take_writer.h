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
  int cells = 0;  // of the garment
  int lost_pictures = 0;
  double median_pitch_px = 0;     // of the scoreable cells, all views
  double scoreable_per_view = 0;  // cells, in the mean
};

struct TakeFileOptions {
  std::string image_ending = "png";  // png, jpg or tif; pictures of more than 8 bits are png or tif
  int jpeg_quality = 95;

  // `bits` of the pictures.
  absl::Status Validate(int bits) const;
};

// Writes <out>/<frame>/<camera>.png, rig.json, board.json and board.png, template/ and
// truth/{pictures.csv,<frame>/{mesh.ply,<camera>.truth}}. The folder appears under its name when it is
// complete; until then it is <out>.partial-<process id>. `on_view` (may be empty) is called after each view,
// from any thread. Takes every frame out of `take`.
// AlreadyExists when <out> exists and is not an empty folder; Cancelled, with nothing left behind, when
// `stop` is requested. Parallel over views in the calling thread's TBB arena; the same bytes at any thread
// count.
absl::StatusOr<TakeSummary> WriteSyntheticTake(SyntheticTake& take, const std::string& out,
                                               const TakeFileOptions& options = {},
                                               const std::function<void()>& on_view = {},
                                               const std::stop_token& stop = {});

}  // namespace weft
