#include "services/work/animation/graph_poses.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "animation/paper/pixel_avatar.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/cloth_take.h"

namespace weft {
namespace {

// Of one take.
struct TakePoses {
  std::vector<Eigen::VectorXd> learnt, held_out;
  double learnt_mm = 0, held_out_mm = 0;  // sums over frames
};

AvatarTable PriorTable(const char* name, size_t rows, size_t columns, std::vector<float> values) {
  return {name, static_cast<int>(rows), static_cast<int>(columns), false, std::move(values)};
}

AvatarTable PosesTable(const char* name, const std::vector<Eigen::VectorXd>& poses,
                       const std::vector<float>& unit) {
  std::vector<float> values;
  for (const Eigen::VectorXd& pose : poses)
    for (size_t i = 0; i < unit.size(); ++i)
      values.push_back(static_cast<float>(pose[static_cast<Eigen::Index>(i)] / unit[i]));
  return PriorTable(name, poses.size(), unit.size(), std::move(values));
}

AvatarTable PointsTable(const char* name, const std::vector<Eigen::Vector3d>& points) {
  std::vector<float> values;
  for (const Eigen::Vector3d& p : points)
    for (int k = 0; k < 3; ++k) values.push_back(static_cast<float>(p[k]));
  return PriorTable(name, points.size(), 3, std::move(values));
}

}  // namespace

absl::StatusOr<GraphPoses> FitGraphPoses(TrainingTakes& takes, const DeformationGraph& graph,
                                         const GraphFitOptions& options, int every,
                                         const std::function<void(double share)>& on_progress,
                                         const std::stop_token& stop) {
  const std::vector<TrainingTake> told = takes.Frames().takes;
  std::vector<TakePoses> of_take(told.size());
  std::vector<absl::Status> status(told.size());
  int all = 0;
  for (const TrainingTake& take : told) all += (take.frames + every - 1) / every;
  struct {
    Mutex mutex;
    int done ABSL_GUARDED_BY(mutex) = 0;
  } progress;
  tbb::parallel_for(size_t{0}, told.size(), [&](size_t t) {
    absl::StatusOr<ClothTake> take = takes.take(static_cast<int>(t)).OpenAgain();
    if (!take.ok()) {
      status[t] = take.status();
      return;
    }
    GraphFit fit(graph, options);
    std::vector<Eigen::Isometry3d> motions;
    for (int f = 0; f < told[t].frames && status[t].ok(); f += every) {
      if (stop.stop_requested()) {
        status[t] = absl::CancelledError("the fit of the graph was stopped");
        return;
      }
      const absl::StatusOr<ClothFrame> frame = take->Read(f);
      if (status[t] = frame.status(); !frame.ok()) return;
      absl::StatusOr<std::vector<Eigen::Isometry3d>> fitted = fit.Fit(frame->vertices_mm, std::move(motions));
      if (status[t] = fitted.status(); !fitted.ok()) return;
      motions = *std::move(fitted);
      const std::vector<Eigen::Vector3d> mesh = SkinnedMesh(graph, motions);
      double off = 0;
      for (size_t v = 0; v < mesh.size(); ++v)
        off += (mesh[v] - frame->vertices_mm[v]).norm() / static_cast<double>(mesh.size());
      const bool is_learnt = f < LearntFrames(told, t);
      (is_learnt ? of_take[t].learnt : of_take[t].held_out).push_back(NumbersOf(PoseOfNodes(graph, motions)));
      (is_learnt ? of_take[t].learnt_mm : of_take[t].held_out_mm) += off;
      const MutexLock lock(progress.mutex);
      ++progress.done;
      if (on_progress) on_progress(static_cast<double>(progress.done) / all);
    }
  });
  GraphPoses out;
  for (size_t t = 0; t < told.size(); ++t) {
    if (!status[t].ok()) return status[t];
    std::move(of_take[t].learnt.begin(), of_take[t].learnt.end(), std::back_inserter(out.learnt));
    std::move(of_take[t].held_out.begin(), of_take[t].held_out.end(), std::back_inserter(out.held_out));
    out.learnt_left_mm += of_take[t].learnt_mm, out.held_out_left_mm += of_take[t].held_out_mm;
  }
  out.learnt_left_mm /= std::max<double>(1, static_cast<double>(out.learnt.size()));
  out.held_out_left_mm /= std::max<double>(1, static_cast<double>(out.held_out.size()));
  return out;
}

std::string EncodePriorTask(const DeformationGraph& graph, const std::vector<float>& unit,
                            const GraphPoses& poses) {
  std::vector<Eigen::Vector3d> nodes;
  for (int i = 0; i < graph.nodes(); ++i) nodes.push_back(graph.NodeMm(i));
  const size_t per_vertex = static_cast<size_t>(graph.nodes_of_vertex);
  return EncodeAvatarSpace(
      {PosesTable("pose", poses.learnt, unit), PosesTable("held_out_pose", poses.held_out, unit),
       PriorTable("unit", 1, unit.size(), unit),
       PriorTable("parent", 1, graph.parent.size(), {graph.parent.begin(), graph.parent.end()}),
       PointsTable("node_mm", nodes), PointsTable("rest_mm", graph.rest_mm),
       PriorTable("skin_node", graph.rest_mm.size(), per_vertex,
                  {graph.skin_node.begin(), graph.skin_node.end()}),
       PriorTable("skin_weight", graph.rest_mm.size(), per_vertex,
                  {graph.skin_weight.begin(), graph.skin_weight.end()})});
}

absl::StatusOr<GraphPrior> DecodePrior(std::string_view bytes, std::vector<float> unit,
                                       const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<AvatarTable> tables, DecodeAvatarSpace(bytes, source_name));
  GraphPrior out;
  out.unit = std::move(unit);
  out.layers = LayersOf(tables);
  if (absl::Status status = out.Validate(out.nodes()); !status.ok())
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(status.message())));
  return out;
}

}  // namespace weft
