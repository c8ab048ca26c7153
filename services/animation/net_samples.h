// What a net of an avatar learns from: driven frames whose truth is known, as images on the garment's atlas.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "animation/atlas.h"
#include "animation/sparse_view_avatar.h"

namespace weft {

struct NetSampleRequest {
  std::vector<std::string> sources;  // simulated takes, data sets; OpenClothSource
  std::string garment;               // folder of the template; empty: that of the first source
  // A class of motion that no training sample shows: that take is driven for validation alone.
  std::string unseen;
  SparseViewTraining training;  // of the shape spaces
  AtlasOptions atlas;
  int rigs = 2;   // camera set-ups for each take and fold
  int every = 2;  // frames
  uint64_t seed = 1;
  std::string out;  // file of samples
};

// A net must repair the errors that a shape space makes on frames that it never saw, so each take is driven
// by spaces that were learnt without it: without its whole take, and without its half. Cameras stand at
// random places, two, three or four of them. The same bytes at any thread count (layout:
// docs/file-formats.md). `on_progress` as that of TrainSparseView. Errors of the sources and of
// TrainSparseView.
absl::Status MakeNetSamples(const NetSampleRequest& request,
                            const std::function<void(std::string_view stage, double share)>& on_progress,
                            const std::stop_token& stop);

}  // namespace weft
