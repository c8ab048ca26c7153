// The training of an avatar with a net: what a trainer is asked for, and the folder in which samples and
// state lie until the avatar is whole.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "services/work/animation/training_takes.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

// What a trainer of nets is to do.
enum class NetKind {
  kCorrection,  // how far driven meshes are off
  kPixels,      // offsets of a carrier, of an avatar of pixels
  kPrior,       // poses of a deformation graph
};
struct NetTask {
  NetKind kind = NetKind::kCorrection;
  std::string samples;  // file of samples, or of a prior's poses
  // It writes net.onnx and sample.bin there, and training.json when it is done; of a prior prior.bin. What it
  // knew when it was stopped lies there as well.
  std::string folder;
  int64_t steps = 0;
  double hours = 0;  // it ends after these at the latest, earlier runs included; 0: it takes its time
  uint64_t seed = 1;
  int threads = 1;
};
// OK once training.json, or prior.bin, is there; Cancelled when `stop` is requested.
using NetTrainer = std::function<absl::Status(const NetTask& task, const std::stop_token& stop)>;

// In the folder; the last two are the trainer's.
inline constexpr char kRecipeFile[] = "recipe.txt", kSamplesFile[] = "samples.bin",
                      kTrainingFile[] = "training.json", kPriorFile[] = "prior.bin";

// Beside the avatar.
std::string TrainingFolderOf(const std::string& avatar);

// What avatar.json tells of the sources. Errors of the takes.
absl::StatusOr<v1::Avatar> DescribeSources(TrainingTakes& takes);
// A line for each source, for a recipe.
std::string SourceLines(const v1::Avatar& about);

// A folder of this training, which may have come far already. FailedPrecondition: it is of another recipe.
absl::Status BeginTrainingFolder(const std::string& folder, const std::string& recipe);

// What the trainer wrote.
absl::StatusOr<AvatarNet> ReadTrainedNet(const std::string& folder, const AtlasOptions& atlas,
                                         v1::AvatarNetTraining* training);

}  // namespace weft
