#include "services/work/animation/baseline_meshes.h"

#include <Eigen/Geometry>
#include <utility>

#include "alignment/placement.h"
#include "base/status_macros.h"
#include "services/formats/options/pipeline_options.h"
#include "services/work/pipeline/frame_cloud.h"

namespace weft {
namespace {

// Rounds of averaging over neighbours, so that cloth bends over joints.
constexpr int kSmoothing = 12;

using JointMotion = Eigen::Matrix<double, 3, 4>;

}  // namespace

RegistrationBaseline::RegistrationBaseline(const Template& garment) : garment_(garment), model_(garment) {}

absl::StatusOr<RegisteredMesh> RegistrationBaseline::Register(
    const Rig& rig, const std::vector<ViewObservations>& views) const {
  const PipelineOptions options;
  WEFT_ASSIGN_OR_RETURN(const Cloud cloud, TriangulateFrame(kNeverKept, rig, {}, views, options.cloud));
  WEFT_ASSIGN_OR_RETURN(AlignResult aligned,
                        Align(model_, TargetsFromCloud(garment_, cloud).targets, options.alignment));
  return std::move(aligned.mesh);
}

PlacedShapes PlaceShapes(const ShapeSpace& space, const std::vector<Eigen::Vector3d>& truth_mm) {
  const auto moved = [](const Eigen::Isometry3d& by, std::vector<Eigen::Vector3d> points) {
    for (Eigen::Vector3d& p : points) p = by * p;
    return points;
  };
  const std::vector<Eigen::Vector3d> mean = space.Shape(Eigen::VectorXd::Zero(space.components()));
  Eigen::Isometry3d to_space = RigidFit(truth_mm, mean);
  PlacedShapes out;
  out.mean_mm = moved(to_space.inverse(), mean);
  std::vector<Eigen::Vector3d> shape;
  for (int round = 0; round < 2; ++round) {
    shape = space.Shape(space.Project(moved(to_space, truth_mm)));
    to_space = RigidFit(truth_mm, shape);
  }
  out.best_mm = moved(to_space.inverse(), std::move(shape));
  return out;
}

std::vector<Eigen::Vector3d> SkinnedBaseline::MeshIn(const FigurePose& pose) const {
  const Body there(pose, shape_);
  std::vector<JointMotion> motions;
  for (const Eigen::Vector3d& p : bound_mm_)
    motions.push_back(bound_.MotionTo(there, p).matrix().topRows<3>());
  for (int round = 0; round < kSmoothing; ++round) {
    std::vector<JointMotion> next = motions;
    for (int v = 0; v < graph_.vertices; ++v) {
      for (int i = graph_.first[v]; i < graph_.first[v + 1]; ++i) next[v] += motions[graph_.neighbor[i]];
      next[v] /= 1 + graph_.degree(v);
    }
    motions = std::move(next);
  }
  std::vector<Eigen::Vector3d> out;
  for (size_t v = 0; v < bound_mm_.size(); ++v) out.push_back(motions[v] * bound_mm_[v].homogeneous());
  return out;
}

}  // namespace weft
