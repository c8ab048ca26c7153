// From meshes to an avatar of the preset paper (animation/paper/pixel_avatar.h).
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "animation/paper/graph_fit.h"
#include "services/work/animation/pixel_avatar_file.h"
#include "services/work/animation/pixel_samples.h"
#include "services/work/animation/training_folder.h"

namespace weft {

struct PixelAvatarRequest {
  std::vector<std::string> sources, held_out;  // as of AvatarRequest
  std::string garment;
  double fps = 0;
  uint64_t seed = 1;
  GraphOptions graph;
  GraphFitOptions fit;
  int every = 2;  // frames that the prior is learnt from
  PixelSampleRequest samples;
  int64_t steps = 8000;  // of the net; the prior takes half as many
  double hours = 0;
  int threads = 1;
  bool keep = false;  // the folder of the training
  NetTrainer trainer;
  std::string out;
};

// Fits a deformation graph to the meshes, has its prior trained, then the net, and writes the avatar. Stages
// are "graph", "prior", "samples" and "net"; a stopped training goes on with the last one that it had begun.
// Errors as of TrainAvatar.
absl::StatusOr<PixelAvatarFile> TrainPixelAvatar(
    const PixelAvatarRequest& request,
    const std::function<void(std::string_view stage, double share)>& on_progress,
    const std::stop_token& stop);

}  // namespace weft
