#include "services/work/animation/pixel_samples.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"
#include "animation/paper/graph_tracker.h"
#include "animation/paper/pixel_driver.h"
#include "animation/paper/smooth_functions.h"
#include "animation/sparse_view/driving_features.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "base/counter_random.h"
#include "base/status_macros.h"
#include "services/work/animation/cloth_take.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/sample_writer.h"

namespace weft {
namespace {

constexpr int kSmoothFunctions = 60;
// As weft-train has them.
constexpr int kTangentFeatures = 6;
constexpr double kTangentUnitMm = 10;
constexpr uint32_t kLearnt = 0, kHeldOut = 1;  // of the file

// Frames of a take that are driven one after another.
struct PixelRun {
  int take = 0, first = 0, last = 0, every = 1;
  uint32_t split = kLearnt;
};

class PixelSampleMaker {
 public:
  PixelSampleMaker(const PixelSampleRequest& request, const Template& garment, const PixelAvatar& avatar,
                   const DeformationGraph& graph, const Atlas& atlas, Eigen::MatrixXf functions)
      : request_(request),
        garment_(garment),
        avatar_(avatar),
        graph_(graph),
        atlas_(atlas),
        functions_(std::move(functions)),
        nodes_(garment),
        writer_(atlas, kPixelFeatures + kTangentFeatures, kPixelAnswers) {}

  std::string Head() const { return writer_.Head(); }

  absl::Status Run(const PixelRun& run, ClothTake& take, const std::stop_token& stop,
                   std::string* out) const {
    WEFT_ASSIGN_OR_RETURN(const auto seen, ObserveTake(take, kPixelCameras, {garment_, request_.seed}));
    GraphTracker tracker(graph_, avatar_.prior, {});
    for (int f = run.first; f < run.last; f += run.every) {
      if (stop.stop_requested()) return absl::CancelledError("the making of samples was stopped");
      WEFT_ASSIGN_OR_RETURN(const ClothFrame truth, take.Read(f));
      WEFT_ASSIGN_OR_RETURN(const auto found, seen->Observe(f, truth));
      const std::vector<DrivingView> views = DrivingViewsOf(found, seen->rig());
      WEFT_ASSIGN_OR_RETURN(const auto rays, RaysOf(views, nodes_, SparseViewOptions().cloth_sigma_px));
      const TrackedGraph track = tracker.Follow(rays);
      if (track.lost) continue;
      const std::vector<Eigen::Vector3d> carrier = tracker.MeshOf(track.state);
      const std::array<uint32_t, 4> about = {run.split, static_cast<uint32_t>(run.take),
                                             static_cast<uint32_t>(f), kPixelCameras};
      Append(about, views, carrier, truth.vertices_mm, out);
      const std::vector<Eigen::Vector3d> normals = VertexNormals(carrier, garment_.rest.faces);
      for (int k = 0; run.split == kLearnt && k < request_.displaced; ++k) {
        const uint64_t key = KeyOf(request_.seed, absl::StrCat(take.name(), " ", f, " ", k));
        const Eigen::VectorXf by = RandomMix(functions_, request_.displaced_mm, key);
        std::vector<Eigen::Vector3d> displaced = carrier;
        for (size_t v = 0; v < displaced.size(); ++v)
          displaced[v] += static_cast<double>(by[static_cast<Eigen::Index>(v)]) * normals[v];
        Append(about, views, displaced, truth.vertices_mm, out);
      }
    }
    return absl::OkStatus();
  }

 private:
  void Append(const std::array<uint32_t, 4>& about, std::span<const DrivingView> views,
              const std::vector<Eigen::Vector3d>& carrier, const std::vector<Eigen::Vector3d>& truth,
              std::string* out) const {
    AtlasImage features = atlas_.Gather(PixelFeatures(views, nodes_, carrier), kPixelFeatures);
    std::vector<float> places, offsets;
    const Eigen::Vector3d middle = carrier.front();
    for (size_t v = 0; v < carrier.size(); ++v)
      for (int k = 0; k < 3; ++k) {
        places.push_back(static_cast<float>((carrier[v] - middle)[k] / kTangentUnitMm));
        offsets.push_back(static_cast<float>((truth[v] - carrier[v])[k] / kAnswerUnitMm));
      }
    AppendTangents(atlas_.Gather(places, 3), &features);
    writer_.Append(about, features, atlas_.Gather(offsets, kPixelAnswers), out);
  }

  // Central differences, along and down.
  void AppendTangents(const AtlasImage& places, AtlasImage* features) const {
    const auto width = static_cast<size_t>(places.width), height = static_cast<size_t>(places.height);
    const auto base = features->values.size();
    features->values.resize(base + kTangentFeatures * places.PlaneSize(), 0);
    features->channels += kTangentFeatures;
    for (size_t c = 0; c < 3; ++c) {
      const float* from = &places.values[c * places.PlaneSize()];
      float* along = &features->values[base + c * places.PlaneSize()];
      float* down = &features->values[base + (3 + c) * places.PlaneSize()];
      for (size_t y = 1; y + 1 < height; ++y)
        for (size_t x = 1; x + 1 < width; ++x) {
          const size_t at = y * width + x;
          along[at] = 0.5f * (from[at + 1] - from[at - 1]);
          down[at] = 0.5f * (from[at + width] - from[at - width]);
        }
    }
  }

  const PixelSampleRequest& request_;
  const Template& garment_;
  const PixelAvatar& avatar_;
  const DeformationGraph& graph_;
  const Atlas& atlas_;
  Eigen::MatrixXf functions_;
  NodeVertices nodes_;
  SampleWriter writer_;
};

}  // namespace

absl::Status CheckFixedCameras(TrainingTakes& takes, uint64_t seed) {
  std::string first;
  for (int t = 0; t < takes.size(); ++t) {
    ClothTake& take = takes.take(t);
    WEFT_ASSIGN_OR_RETURN(const auto seen, ObserveTake(take, kPixelCameras, {takes.garment(), seed}));
    const std::string hash = seen->rig().ContentHash();
    if (t > 0 && hash != first)
      return absl::FailedPreconditionError(absl::StrCat(
          take.name(), " is seen by other cameras than ", takes.take(0).name(), " (", hash, " and ", first,
          "), and the preset paper learns from two that stay where they are; give takes whose "
          "rig.json is the same, and has two cameras"));
    first = hash;
  }
  return absl::OkStatus();
}

absl::Status MakePixelSamples(TrainingTakes& takes, const PixelAvatar& avatar,
                              const PixelSampleRequest& request,
                              const std::function<void(double share)>& on_progress,
                              const std::stop_token& stop) {
  const Template& garment = takes.garment();
  WEFT_ASSIGN_OR_RETURN(const Atlas atlas, Atlas::Build(garment, ChartsOnBoard(garment), request.atlas));
  const MeshGraph mesh_graph = BuildMeshGraph(garment.rest);
  WEFT_ASSIGN_OR_RETURN(const DeformationGraph graph,
                        BuildDeformationGraph(garment.rest, mesh_graph, avatar.graph));
  WEFT_ASSIGN_OR_RETURN(Eigen::MatrixXf functions, SmoothFunctions(mesh_graph, kSmoothFunctions));
  const PixelSampleMaker maker(request, garment, avatar, graph, atlas, std::move(functions));
  const std::vector<TrainingTake> told = takes.Frames().takes;
  std::vector<PixelRun> runs;
  for (size_t t = 0; t < told.size(); ++t) {
    const int learnt = LearntFrames(told, t), take = static_cast<int>(t);
    if (learnt > 0) runs.push_back({take, 0, learnt, request.every, kLearnt});
    if (learnt < told[t].frames) runs.push_back({take, learnt, told[t].frames, 1, kHeldOut});
  }
  constexpr size_t kRunsAtOnce = 2;
  return WriteSamples(
      request.out, maker.Head(), runs.size(), kRunsAtOnce,
      [&](size_t k, std::string* samples) {
        absl::StatusOr<ClothTake> take = takes.take(runs[k].take).OpenAgain();
        return take.ok() ? maker.Run(runs[k], *take, stop, samples) : take.status();
      },
      on_progress);
}

}  // namespace weft
