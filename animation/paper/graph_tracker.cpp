#include "animation/paper/graph_tracker.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "animation/rays/view_poses.h"
#include "base/median.h"

namespace weft {
namespace {

constexpr int kStepsOfStart = 4;
// A step this small, in units of z, ends the iteration.
constexpr double kSmallLatentStep = 1e-3;

}  // namespace

absl::Status GraphTrackerOptions::Validate() const {
  const bool counts_are_good = max_rays >= 100 && min_rays >= 10 && max_steps >= 1;
  const bool sizes_are_good = spread_mm > 0 && robust_spreads > 0 && rays_of_view > 0 && agreeing_mm > 0;
  if (!counts_are_good || !sizes_are_good || !(min_agreeing_share >= 0 && min_agreeing_share <= 1))
    return absl::InvalidArgumentError("graph tracking: a number is out of its limits");
  return absl::OkStatus();
}

GraphTracker::GraphTracker(const DeformationGraph& graph, const GraphPrior& prior,
                           const GraphTrackerOptions& options)
    : graph_(graph), prior_(prior), options_(options), middle_mm_(Eigen::Vector3d::Zero()) {
  std::vector<Eigen::Vector3d> mesh =
      MeshOf({Eigen::Isometry3d::Identity(), Eigen::VectorXd::Zero(prior.latents())});
  for (const Eigen::Vector3d& p : mesh) middle_mm_ += p / static_cast<double>(mesh.size());
  for (Eigen::Vector3d& p : mesh) p -= middle_mm_;
  long_axis_ = LongAxis(mesh);
}

std::vector<Eigen::Vector3d> GraphTracker::MeshOf(const GraphState& state) const {
  return SkinnedMesh(graph_, PlaceNodes(graph_, state.root, prior_.Decode(state.z, nullptr)));
}

std::vector<Eigen::Vector3d> GraphTracker::PointsOf(const std::vector<VertexRay>& rays,
                                                    const GraphState& state) const {
  const auto motions = PlaceNodes(graph_, state.root, prior_.Decode(state.z, nullptr));
  std::vector<Eigen::Vector3d> out;
  out.reserve(rays.size());
  for (const VertexRay& ray : rays) out.push_back(SkinnedPoint(graph_, ray.vertex, motions));
  return out;
}

std::vector<double> GraphTracker::Weigh(const std::vector<VertexRay>& rays,
                                        const std::vector<Eigen::Vector3d>& points, double widening,
                                        double* cost) const {
  std::vector<double> off(rays.size()), out(rays.size());
  int views = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    off[i] = rays[i].OffsetTo(points[i]).norm() / options_.spread_mm;
    views = std::max(views, rays[i].view + 1);
  }
  const double misfit = std::max(1.0, Median(off) / kMedianAcross);
  const double share = std::min(1.0, options_.rays_of_view * views / static_cast<double>(rays.size()));
  *cost = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const double far = off[i] * options_.spread_mm / options_.agreeing_mm;
    *cost += far * far / (1 + far * far);
    out[i] = share * GemanMcClureWeight(off[i] / (options_.robust_spreads * misfit * widening)) /
             (options_.spread_mm * options_.spread_mm);
  }
  return out;
}

void GraphTracker::Improve(const std::vector<VertexRay>& rays, int steps, Fit* fit) const {
  const Eigen::Index latents = prior_.latents(), size = 6 + latents;
  for (int step = 0; step < steps; ++step) {
    GraphState& state = fit->state;
    const std::vector<Eigen::Vector3d> points = PointsOf(rays, state);
    const std::vector<double> weight = Weigh(rays, points, WideningAt(step), &fit->cost);
    Eigen::MatrixXd pose_ways;
    const GraphPose pose = prior_.Decode(state.z, &pose_ways);
    const auto motions = PlaceNodes(graph_, Eigen::Isometry3d::Identity(), pose);
    const NodeVelocities velocities = VelocitiesOf(graph_, pose, motions, pose_ways);
    const Eigen::Matrix3d turn = state.root.linear();
    const Eigen::Vector3d about = state.root * middle_mm_;
    Eigen::MatrixXd rows(2 * static_cast<Eigen::Index>(rays.size()), size);
    Eigen::VectorXd left(rows.rows());
    for (size_t i = 0; i < rays.size(); ++i) {
      Eigen::Matrix<double, 3, 2> across;
      Eigen::Vector3d a, b;
      AcrossOf(rays[i].direction, &a, &b);
      across << a, b;
      across *= std::sqrt(weight[i]);
      const Eigen::Vector3d arm = points[i] - about;
      const auto at = 2 * static_cast<Eigen::Index>(i);
      for (int k = 0; k < 2; ++k) {
        rows.block<1, 3>(at + k, 0) = arm.cross(across.col(k)).transpose();
        rows.block<1, 3>(at + k, 3) = across.col(k).transpose();
      }
      rows.block(at, 6, 2, latents) =
          (turn.transpose() * across).transpose() * VelocityOf(graph_, rays[i].vertex, motions, velocities);
      left.segment<2>(at) = across.transpose() * rays[i].OffsetTo(points[i]);
    }
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
    normal.diagonal().head(6).array() *= 1 + 1e-9;
    normal.diagonal().tail(latents).array() += 1;
    Eigen::VectorXd right = rows.transpose() * left;
    right.tail(latents) -= state.z;
    const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> solver(normal);
    if (solver.info() != Eigen::Success) return;
    const Eigen::VectorXd by = solver.solve(right);
    if (!by.allFinite()) return;
    if (const double angle = by.head<3>().norm(); angle > 0) {
      const Eigen::AngleAxisd rotation(angle, by.head<3>() / angle);
      state.root.linear() = Eigen::Quaterniond(rotation * turn).normalized().toRotationMatrix();
    }
    state.root.translation() = about + by.segment<3>(3) - state.root.linear() * middle_mm_;
    state.z += by.tail(latents);
    if (step > 1 && by.tail(latents).cwiseAbs().maxCoeff() < kSmallLatentStep) break;
  }
  Weigh(rays, PointsOf(rays, fit->state), 1, &fit->cost);
}

GraphTracker::Fit GraphTracker::StartAnew(const std::vector<VertexRay>& rays) const {
  Fit best;
  best.state.z = Eigen::VectorXd::Zero(prior_.latents());
  std::vector<Eigen::Vector3d> points = PointsOf(rays, best.state);
  for (Eigen::Vector3d& p : points) p -= middle_mm_;
  bool found = false;
  for (const Eigen::Isometry3d& start : PosesFromViews(rays, points, long_axis_)) {
    Fit fit;
    fit.state = {start * Eigen::Translation3d(-middle_mm_), Eigen::VectorXd::Zero(prior_.latents())};
    Improve(rays, kStepsOfStart, &fit);
    if (!found || fit.cost < best.cost) best = fit;
    found = true;
  }
  if (found) Improve(rays, 2 * options_.max_steps, &best);
  return best;
}

double GraphTracker::AgreeingShare(const std::vector<VertexRay>& rays, const GraphState& state) const {
  const std::vector<Eigen::Vector3d> points = PointsOf(rays, state);
  double agreeing = 0;
  for (size_t i = 0; i < rays.size(); ++i)
    agreeing += rays[i].OffsetTo(points[i]).norm() <= options_.agreeing_mm ? 1 : 0;
  return rays.empty() ? 0 : agreeing / static_cast<double>(rays.size());
}

TrackedGraph GraphTracker::Follow(const std::vector<VertexRay>& rays) {
  TrackedGraph out;
  out.state.z = Eigen::VectorXd::Zero(prior_.latents());
  out.lost = static_cast<int>(rays.size()) < options_.min_rays;
  if (out.lost) {
    Reset();
    return out;
  }
  std::vector<VertexRay> chosen;
  const size_t most = std::min(rays.size(), static_cast<size_t>(options_.max_rays));
  for (size_t i = 0; i < most; ++i) chosen.push_back(rays[i * rays.size() / most]);
  if (last_) {
    Fit fit{*last_, 0};
    Improve(chosen, options_.max_steps, &fit);
    out.state = fit.state;
    out.agreeing_share = AgreeingShare(chosen, out.state);
  }
  if (out.agreeing_share < options_.min_agreeing_share) {
    out.state = StartAnew(chosen).state;
    out.agreeing_share = AgreeingShare(chosen, out.state);
  }
  out.lost = out.agreeing_share < options_.min_agreeing_share;
  if (out.lost) {
    Reset();
  } else {
    last_ = out.state;
  }
  return out;
}

}  // namespace weft
