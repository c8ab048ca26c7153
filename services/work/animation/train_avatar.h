// From recorded or simulated meshes to an avatar's folder.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/training_folder.h"

namespace weft {

struct NetRequest {
  AtlasOptions atlas;
  int64_t steps = 8000;
  double hours = 0;
  int threads = 1;
  bool keep = false;  // the folder of the training, where it is over
  NetTrainer trainer;
};

struct AvatarRequest {
  std::vector<std::string> sources;   // to learn from; OpenClothSource says what they may be
  std::vector<std::string> held_out;  // not learnt from: they tell how far the avatar is to be trusted
  std::string garment;                // folder of the template; empty: that of the first source
  double fps = 0;                     // of meshes whose take tells no times; 0: 30
  SparseViewTraining training;
  std::optional<NetRequest> net;  // an avatar with a net
  std::string out;
};

struct TrainedAvatar {
  AvatarFile file;         // as it stands in the folder
  std::string net_remark;  // why a net that was asked for is left out
};

// Learns and writes the avatar. Of data sets the split train is learnt from and the split validate is held
// out; tests are never read. A net is trained first, on frames that shape spaces drove without having learnt
// them; then the avatar learns, and sigma is fitted with the net at work. A net that brings held-out frames
// no nearer to the truth is left out. `on_progress` (may be empty) as that of TrainSparseView, with "spaces"
// and "samples" before. Errors of TrainingTakes, TrainSparseView, MakeNetSamples, the trainer and
// WriteAvatar, those of the place of the avatar before anything is learnt. FailedPrecondition: the training
// folder is of another training. Cancelled when `stop` is requested; of a net's training its folder is left,
// and the same request goes on.
absl::StatusOr<TrainedAvatar> TrainAvatar(
    const AvatarRequest& request,
    const std::function<void(std::string_view stage, double share)>& on_progress,
    const std::stop_token& stop);

}  // namespace weft
