#include "services/work/animation/train_avatar.h"

#include <array>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/work/animation/net_samples.h"
#include "services/work/animation/training_folder.h"
#include "services/work/animation/training_takes.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// All that decides what the samples and the net become; hours do not.
std::string RecipeOf(const v1::Avatar& about, const Template& garment, const AvatarRequest& request) {
  const SparseViewTraining& training = request.training;
  std::string out =
      absl::StrCat("weft ", WEFT_VERSION, "\ntemplate ", garment.ContentHash(), "\ncomponents ",
                   training.components, "\nmax_frames ", training.max_frames, "\nseed ", training.seed,
                   "\nsteps ", request.net->steps, "\nthreads ", request.net->threads, "\natlas ",
                   request.net->atlas.level, " ", request.net->atlas.gutter, "\n", SourceLines(about));
  return out;
}

using OnProgress = std::function<void(std::string_view stage, double share)>;

// The net, from where an earlier run stopped.
absl::StatusOr<AvatarNet> TrainNet(TrainingTakes& takes, const AvatarRequest& request,
                                   const std::string& folder, const OnProgress& on_progress,
                                   const std::stop_token& stop, v1::AvatarNetTraining* training) {
  const NetRequest& asked = *request.net;
  const auto path = [&](const char* name) { return (fs::path(folder) / name).string(); };
  if (!PathExists(path(kSamplesFile))) {
    NetSampleRequest samples;
    samples.training = request.training;
    samples.atlas = asked.atlas;
    samples.seed = request.training.seed;
    samples.out = path(kSamplesFile);
    WEFT_RETURN_IF_ERROR(MakeNetSamples(takes, samples, on_progress, stop));
  }
  if (!PathExists(path(kTrainingFile))) {
    const NetTask task{NetKind::kCorrection, path(kSamplesFile),    folder,       asked.steps,
                       asked.hours,          request.training.seed, asked.threads};
    WEFT_RETURN_IF_ERROR(asked.trainer(task, stop));
  }
  return ReadTrainedNet(folder, asked.atlas, training);
}

std::string WhyLeftOut(const std::array<NetGain, SigmaScale::kCameras>& gains) {
  std::string out = "the net is left out: ";
  bool is_tried = false;
  for (size_t k = 0; k < gains.size(); ++k) {
    const NetGain& gain = gains[k];
    if (gain.frames == 0) continue;
    absl::StrAppendFormat(&out, "%s%.3f mm with it and %.3f without before %d cameras", is_tried ? ", " : "",
                          gain.after_mm, gain.before_mm, k + 1);
    is_tried = true;
  }
  absl::StrAppend(
      &out, is_tried ? " in the mean of held-out frames; train with more motions or more steps"
                     : "no held-out frames follow each other, so nobody knows what it is good for; hold "
                       "out more of them");
  return out;
}

}  // namespace

absl::StatusOr<TrainedAvatar> TrainAvatar(const AvatarRequest& request, const OnProgress& on_progress,
                                          const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(request.training.Validate());
  WEFT_RETURN_IF_ERROR(CheckAvatarPlace(request.out));
  WEFT_ASSIGN_OR_RETURN(TrainingTakes takes,
                        TrainingTakes::Open(request.sources, request.held_out, request.garment, request.fps));
  WEFT_ASSIGN_OR_RETURN(v1::Avatar about, DescribeSources(takes));
  const Template& garment = takes.garment();
  const std::string folder = TrainingFolderOf(request.out);
  AvatarNet net;
  if (request.net) {
    WEFT_RETURN_IF_ERROR(BeginTrainingFolder(folder, RecipeOf(about, garment, request)));
    WEFT_ASSIGN_OR_RETURN(
        net, TrainNet(takes, request, folder, on_progress, stop, about.mutable_net()->mutable_training()));
  }
  const TrainingFrames frames = takes.Frames();
  WEFT_ASSIGN_OR_RETURN(SparseViewAvatar avatar,
                        LearnSparseView(garment, frames, request.training, on_progress, stop));
  avatar.net = std::move(net);
  WEFT_RETURN_IF_ERROR(CalibrateSparseView(garment, frames, on_progress, stop, &avatar));
  std::string remark;
  if (request.net && avatar.net.empty()) remark = WhyLeftOut(avatar.net.gain);
  if (stop.stop_requested()) return absl::CancelledError("the training was stopped");
  WEFT_RETURN_IF_ERROR(WriteAvatar(request.out, std::move(about), avatar));
  if (request.net && !request.net->keep) {
    std::error_code ignored;  // it has served
    fs::remove_all(folder, ignored);
  }
  WEFT_ASSIGN_OR_RETURN(AvatarFile file, ReadAvatar(request.out));
  return TrainedAvatar{std::move(file), std::move(remark)};
}

}  // namespace weft
