// A synthetic take as an image-folder dump with ground truth.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "services/formats/synthetic/take_folder.h"
#include "simulation/synthetic_take.h"

namespace weft {

// What was written, for the user.
struct TakeSummary {
  int frames = 0;
  int cameras = 0;
  int cells = 0;  // of the garment
  int lost_pictures = 0;
  int intersecting_frames = 0;    // whose cloth passes through itself
  double median_pitch_px = 0;     // of the scoreable cells, all views
  double scoreable_per_view = 0;  // cells, in the mean
};

struct TakeFileOptions {
  std::string image_ending = "png";  // png, jpg or tif; pictures of more than 8 bits are png or tif
  int jpeg_quality = 95;

  // `bits` of the pictures.
  absl::Status Validate(int bits) const;
};

// Writes <frame>/<camera>.png, rig.json, board.json and board.png, template/ and
// truth/{pictures.csv,<frame>/{mesh.ply,<camera>.truth}} into the take's folder. Frames that stand there
// already are left as they are; the cloth of the next frame moves while one is filmed. `on_view` (may be
// empty) is called after each view, from any thread. Takes every frame out of `take`. Cancelled, with the
// finished frames kept, when `stop` is requested. Parallel over views in the calling thread's TBB arena; the
// same bytes at any thread count, in one go or in several.
absl::StatusOr<TakeSummary> WriteSyntheticTake(SyntheticTake& take, const TakeFolder& folder,
                                               const TakeFileOptions& options = {},
                                               const std::function<void()>& on_view = {},
                                               const std::stop_token& stop = {});

}  // namespace weft
