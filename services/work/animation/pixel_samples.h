// What the net of an avatar of pixels learns from: carriers fitted to two views of known frames.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "animation/atlas/atlas.h"
#include "animation/paper/pixel_avatar.h"
#include "services/work/animation/training_takes.h"

namespace weft {

struct PixelSampleRequest {
  AtlasOptions atlas;
  int every = 2;      // frames that are learnt from; of those held out each one
  int displaced = 3;  // samples of a frame whose carrier is displaced, beside the one where it is not
  // Of the displacement: of the carrier along its normals, a random mix of smooth functions.
  double displaced_mm = 2;
  uint64_t seed = 1;
  std::string out;  // file of samples
};

// FailedPrecondition, with both names, where takes are not seen by the same two cameras (ObserveTake).
absl::Status CheckFixedCameras(TrainingTakes& takes, uint64_t seed);

// Before the two cameras of the takes. Graph and prior of `avatar` are there, its net is not asked. Samples
// end with tangents, as `weft-train pixels` wants them (layout: docs/file-formats.md). The same bytes at any
// thread count. `on_progress` may be empty. Errors of the takes; Cancelled: `stop` was requested; nothing is
// left then.
absl::Status MakePixelSamples(TrainingTakes& takes, const PixelAvatar& avatar,
                              const PixelSampleRequest& request,
                              const std::function<void(double share)>& on_progress,
                              const std::stop_token& stop);

}  // namespace weft
