#include "services/work/animation/train_pixel_avatar.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "alignment/mesh_graph.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/work/animation/graph_poses.h"
#include "services/work/animation/training_takes.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// In the folder of the training: the poses, and what the graph leaves of the meshes.
constexpr char kPosesFile[] = "poses.bin", kLeftFile[] = "left.txt";

// All that decides what the prior and the net become; hours do not.
std::string RecipeOfPixels(const v1::Avatar& about, const Template& garment,
                           const PixelAvatarRequest& request) {
  const PixelSampleRequest& samples = request.samples;
  return absl::StrCat("weft ", WEFT_VERSION, "\npreset paper\ntemplate ", garment.ContentHash(), "\ngraph ",
                      request.graph.nodes, " ", request.graph.nodes_of_vertex, " ", request.fit.distortion,
                      " ", request.every, "\nsamples ", samples.every, " ", samples.displaced, " ",
                      samples.displaced_mm, " ", samples.atlas.level, " ", samples.atlas.gutter, "\nseed ",
                      request.seed, "\nsteps ", request.steps, "\nthreads ", request.threads, "\n",
                      SourceLines(about));
}

class PixelTraining {
 public:
  PixelTraining(const PixelAvatarRequest& request, TrainingTakes& takes,
                const std::function<void(std::string_view, double)>& on_progress, const std::stop_token& stop)
      : request_(request),
        takes_(takes),
        on_progress_(on_progress),
        stop_(stop),
        folder_(TrainingFolderOf(request.out)) {}

  // The graph's prior, and what the graph leaves.
  absl::Status LearnPrior(PixelAvatar* avatar) {
    const Template& garment = takes_.garment();
    WEFT_ASSIGN_OR_RETURN(const auto graph,
                          BuildDeformationGraph(garment.rest, BuildMeshGraph(garment.rest), request_.graph));
    std::vector<float> unit = PoseUnits(graph, kPoseUnitMm);
    if (!Exists(kLeftFile)) {
      WEFT_ASSIGN_OR_RETURN(const auto poses, FitGraphPoses(takes_, graph, request_.fit, request_.every,
                                                            StageOf("graph"), stop_));
      WEFT_RETURN_IF_ERROR(WriteFileAtomically(Path(kPosesFile), EncodePriorTask(graph, unit, poses)));
      WEFT_RETURN_IF_ERROR(WriteFileAtomically(Path(kLeftFile), absl::StrCat(poses.learnt_left_mm)));
    }
    WEFT_ASSIGN_OR_RETURN(const std::string left, ReadWholeFile(Path(kLeftFile)));
    if (!absl::SimpleAtod(left, &avatar->left_mm))
      return absl::DataLossError(
          absl::StrCat(Path(kLeftFile), ": is no number; remove the folder ", folder_));
    if (!Exists(kPriorFile)) {
      const int64_t steps = std::max<int64_t>(1, request_.steps / 2);
      const NetTask task{NetKind::kPrior, Path(kPosesFile), folder_, steps, 0,
                         request_.seed,   request_.threads};
      WEFT_RETURN_IF_ERROR(request_.trainer(task, stop_));
    }
    WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(Path(kPriorFile)));
    WEFT_ASSIGN_OR_RETURN(avatar->prior, DecodePrior(bytes, std::move(unit), Path(kPriorFile)));
    return absl::OkStatus();
  }

  absl::Status LearnNet(PixelAvatar* avatar, v1::AvatarNetTraining* training) {
    if (!Exists(kSamplesFile)) {
      PixelSampleRequest samples = request_.samples;
      samples.seed = request_.seed;
      samples.out = Path(kSamplesFile);
      WEFT_RETURN_IF_ERROR(MakePixelSamples(takes_, *avatar, samples, StageOf("samples"), stop_));
    }
    if (!Exists(kTrainingFile)) {
      const NetTask task{NetKind::kPixels, Path(kSamplesFile), folder_,         request_.steps,
                         request_.hours,   request_.seed,      request_.threads};
      WEFT_RETURN_IF_ERROR(request_.trainer(task, stop_));
    }
    WEFT_ASSIGN_OR_RETURN(avatar->net, ReadTrainedNet(folder_, request_.samples.atlas, training));
    return absl::OkStatus();
  }

 private:
  std::string Path(const char* file) const { return (fs::path(folder_) / file).string(); }
  bool Exists(const char* file) const { return PathExists(Path(file)); }
  std::function<void(double)> StageOf(const char* stage) const {
    return [this, stage](double share) {
      if (on_progress_) on_progress_(stage, share);
    };
  }

  const PixelAvatarRequest& request_;
  TrainingTakes& takes_;
  const std::function<void(std::string_view, double)>& on_progress_;
  const std::stop_token& stop_;
  std::string folder_;
};

}  // namespace

absl::StatusOr<PixelAvatarFile> TrainPixelAvatar(
    const PixelAvatarRequest& request,
    const std::function<void(std::string_view stage, double share)>& on_progress,
    const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(request.graph.Validate());
  WEFT_RETURN_IF_ERROR(request.fit.Validate());
  WEFT_RETURN_IF_ERROR(CheckAvatarPlace(request.out));
  WEFT_ASSIGN_OR_RETURN(TrainingTakes takes,
                        TrainingTakes::Open(request.sources, request.held_out, request.garment, request.fps));
  WEFT_RETURN_IF_ERROR(CheckFixedCameras(takes, request.seed));
  WEFT_ASSIGN_OR_RETURN(v1::Avatar about, DescribeSources(takes));
  const Template& garment = takes.garment();
  const std::string folder = TrainingFolderOf(request.out);
  WEFT_RETURN_IF_ERROR(BeginTrainingFolder(folder, RecipeOfPixels(about, garment, request)));
  PixelAvatar avatar;
  avatar.template_hash = garment.ContentHash();
  avatar.board_hash = garment.board_hash;
  avatar.vertices = static_cast<int>(garment.rest.vertices_mm.size());
  avatar.seed = request.seed;
  avatar.graph = request.graph;
  const std::vector<TrainingTake> told = takes.Frames().takes;
  avatar.fps = told.front().fps;
  for (size_t t = 0; t < told.size(); ++t) {
    avatar.training_frames += LearntFrames(told, t);
    avatar.held_out_frames += told[t].frames - LearntFrames(told, t);
  }
  PixelTraining training(request, takes, on_progress, stop);
  WEFT_RETURN_IF_ERROR(training.LearnPrior(&avatar));
  WEFT_RETURN_IF_ERROR(training.LearnNet(&avatar, about.mutable_net()->mutable_training()));
  if (stop.stop_requested()) return absl::CancelledError("the training was stopped");
  WEFT_RETURN_IF_ERROR(WritePixelAvatar(request.out, std::move(about), avatar));
  if (!request.keep) {
    std::error_code ignored;  // it has served
    fs::remove_all(folder, ignored);
  }
  return ReadPixelAvatar(request.out);
}

}  // namespace weft
