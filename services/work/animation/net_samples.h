// What a net of an avatar learns from: driven frames whose truth is known, as images on the garment's atlas.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "animation/atlas/atlas.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "services/work/animation/training_takes.h"

namespace weft {

struct NetSampleRequest {
  SparseViewTraining training;  // of the shape spaces
  AtlasOptions atlas;
  int rigs = 2;   // camera set-ups for each take and space
  int every = 2;  // frames
  uint64_t seed = 1;
  std::string out;  // file of samples
};

// A net must repair the errors that a shape space makes on frames that it never saw, so each take is driven
// by spaces that were learnt without it: without its motion, and without its half. Frames that are held out
// are driven for validation, by the space of all others. Cameras stand around the y axis at random places,
// two, three or four of them. The same bytes at any thread count (layout: docs/file-formats.md).
// `on_progress` may be empty. InvalidArgument where the takes are too short; errors of the takes and of
// LearnSparseView. Cancelled: `stop` was requested; nothing is left then.
absl::Status MakeNetSamples(TrainingTakes& takes, const NetSampleRequest& request,
                            const std::function<void(std::string_view stage, double share)>& on_progress,
                            const std::stop_token& stop);

}  // namespace weft
