// How near carriers of the large motion come to cloth that was held out, fitted to two views of each frame by
// itself: principal components of vertices, of a deformation graph's poses, and a graph's learnt prior.
// `accuracy_carrier --help`.
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "animation/paper/deformation_graph.h"
#include "animation/paper/graph_fit.h"
#include "animation/paper/graph_prior.h"
#include "animation/paper/graph_tracker.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "animation/sparse_view/view_tracker.h"
#include "base/median.h"
#include "base/stopwatch.h"
#include "services/formats/files/atomic_file.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/cloth_take.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/graph_poses.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/training_takes.h"

namespace weft {
namespace {

struct Options {
  std::string set, avatar, prior, task;
  std::vector<int> components = {32, 48, 96};
  int every = 2, every_test = 5, cameras = 2;
  GraphOptions graph;
  GraphFitOptions fit;
  GraphTrackerOptions tracker;
};

using Mesh = std::vector<Eigen::Vector3d>;
// Rays to a mesh; empty where nothing was found.
using Carrier = std::function<Mesh(const std::vector<VertexRay>&)>;

// Frames that are held out, and the rays that cameras see of them.
struct Seen {
  std::string take;
  Mesh truth_mm;
  std::vector<VertexRay> rays;
};

absl::Status Observe(const Options& options, TrainingTakes& takes, std::vector<Seen>* out) {
  const NodeVertices nodes(takes.garment());
  for (int t = 0; t < takes.size(); ++t) {
    if (!takes.is_held_out(t)) continue;
    ClothTake& take = takes.take(t);
    const auto seen = ObserveTake(take, options.cameras, {takes.garment(), 1});
    if (!seen.ok()) return seen.status();
    for (int f = 0; f < take.frames(); f += options.every_test) {
      const absl::StatusOr<ClothFrame> frame = take.Read(f);
      if (!frame.ok()) return frame.status();
      const auto views = (*seen)->Observe(f, *frame);
      if (!views.ok()) return views.status();
      const auto rays =
          RaysOf(DrivingViewsOf(*views, (*seen)->rig()), nodes, SparseViewOptions().cloth_sigma_px);
      if (!rays.ok()) return rays.status();
      out->push_back({take.name(), frame->vertices_mm, *rays});
    }
  }
  return absl::OkStatus();
}

void Print(const std::string& name, const std::vector<Seen>& frames,
           const std::function<Carrier()>& make_carrier) {
  std::vector<double> mean(frames.size(), -1), ms(frames.size());
  std::vector<std::vector<double>> off(frames.size());
  tbb::parallel_for(size_t{0}, frames.size(), [&](size_t i) {
    const Carrier carrier = make_carrier();
    const Stopwatch watch;
    const Mesh mesh = carrier(frames[i].rays);
    ms[i] = watch.Ms();
    for (size_t v = 0; v < mesh.size(); ++v) off[i].push_back((mesh[v] - frames[i].truth_mm[v]).norm());
  });
  std::vector<double> all;
  int lost = 0;
  for (const std::vector<double>& of_frame : off) {
    all.insert(all.end(), of_frame.begin(), of_frame.end());
    lost += of_frame.empty() ? 1 : 0;
  }
  double sum = 0;
  for (const double e : all) sum += e;
  std::printf("%-40s %4zu frames  mean %6.3f  median %6.3f  95 %% %6.3f mm  lost %d  %6.1f ms\n",
              name.c_str(), frames.size() - static_cast<size_t>(lost),
              all.empty() ? 0 : sum / static_cast<double>(all.size()), Median(all), Quantile(all, 0.95), lost,
              Median(ms));
  std::fflush(stdout);
}

// Of vertices; regions 0: the space's coefficients alone.
void PrintVertices(const std::string& name, const std::vector<Seen>& frames, const Template& garment,
                   const SparseViewAvatar& avatar, int regions) {
  const AlignmentModel model(garment);
  TrackerOptions options;
  options.local.regions = regions;
  Print(name, frames, [&]() -> Carrier {
    const auto tracker =
        std::make_shared<ViewTracker>(model, avatar.space, avatar.left_mm, avatar.acceleration, options);
    return [tracker](const std::vector<VertexRay>& rays) {
      const GarmentTrack track = tracker->Follow(1, rays);
      return track.lost ? Mesh() : tracker->MeshOf(track.state);
    };
  });
}

void PrintGraph(const std::string& name, const std::vector<Seen>& frames, const DeformationGraph& graph,
                const GraphPrior& prior, const GraphTrackerOptions& options) {
  Print(name, frames, [&]() -> Carrier {
    const auto tracker = std::make_shared<GraphTracker>(graph, prior, options);
    return [tracker](const std::vector<VertexRay>& rays) {
      const TrackedGraph track = tracker->Follow(rays);
      return track.lost ? Mesh() : tracker->MeshOf(track.state);
    };
  });
}

absl::Status Run(const Options& options) {
  absl::StatusOr<TrainingTakes> takes = TrainingTakes::Open({options.set}, {}, "", 0);
  if (!takes.ok()) return takes.status();
  const Template& garment = takes->garment();
  const AlignmentModel model(garment);
  std::vector<Seen> frames;
  if (absl::Status status = Observe(options, *takes, &frames); !status.ok()) return status;
  if (!options.avatar.empty()) {
    const absl::StatusOr<AvatarFile> avatar = ReadAvatar(options.avatar);
    if (!avatar.ok()) return avatar.status();
    const std::string components = std::to_string(avatar->avatar.space.components());
    PrintVertices("vertices, " + components, frames, garment, avatar->avatar, 0);
    PrintVertices("vertices, " + components + " and regions", frames, garment, avatar->avatar,
                  LocalShapeOptions().regions);
  }
  const auto graph = BuildDeformationGraph(model.rest(), model.graph(), options.graph);
  if (!graph.ok()) return graph.status();
  const Stopwatch watch;
  const auto poses = FitGraphPoses(*takes, *graph, options.fit, options.every, {}, {});
  if (!poses.ok()) return poses.status();
  std::printf(
      "graph of %d nodes fitted to the mesh itself: mean %.3f mm of %zu learnt, %.3f of %zu held-out "
      "frames; %.0f s\n",
      graph->nodes(), poses->learnt_left_mm, poses->learnt.size(), poses->held_out_left_mm,
      poses->held_out.size(), watch.Seconds());
  const std::vector<float> unit = PoseUnits(*graph, kPoseUnitMm);
  if (!options.task.empty())
    if (absl::Status status = WriteFileAtomically(options.task, EncodePriorTask(*graph, unit, *poses));
        !status.ok())
      return status;
  for (const int components : options.components) {
    const auto prior = LearnLinearPrior(poses->learnt, unit, components);
    if (!prior.ok()) return prior.status();
    PrintGraph("graph's poses, " + std::to_string(components), frames, *graph, *prior, options.tracker);
  }
  if (options.prior.empty()) return absl::OkStatus();
  const absl::StatusOr<std::string> bytes = ReadWholeFile(options.prior);
  if (!bytes.ok()) return bytes.status();
  const auto prior = DecodePrior(*bytes, unit, options.prior);
  if (!prior.ok()) return prior.status();
  PrintGraph("graph, autoencoder of " + std::to_string(prior->latents()), frames, *graph, *prior,
             options.tracker);
  return absl::OkStatus();
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  weft::Options o;
  CLI::App app(
      "Fits carriers that were learnt from the split train of a data set to the rays of cameras before its "
      "split "
      "validate");
  app.add_option("set", o.set)->required();
  app.add_option("--avatar", o.avatar, "Whose principal components of vertices are fitted, too");
  app.add_option("--prior", o.prior, "File of `weft-train prior` that is fitted, too");
  app.add_option("--task", o.task, "Write a file for `weft-train prior`");
  app.add_option("--components", o.components)->delimiter(',');
  app.add_option("--every", o.every, "Of the frames to learn from");
  app.add_option("--every-test", o.every_test);
  app.add_option("--cameras", o.cameras);
  app.add_option("--nodes", o.graph.nodes);
  app.add_option("--distortion", o.fit.distortion);
  app.add_option("--spread", o.tracker.spread_mm);
  app.add_option("--view-rays", o.tracker.rays_of_view);
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = weft::Run(o);
  if (!status.ok()) std::printf("%s\n", std::string(status.message()).c_str());
  return status.ok() ? 0 : 1;
}
