#include "triangulation/camera_bias.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "triangulation/consensus.h"
#include "triangulation/node_index.h"
#include "triangulation/sight.h"

namespace weft {
namespace {

constexpr size_t kLeastBlocks = 6;

// Nodes of the cloud that are looked at, spread evenly.
constexpr size_t kMaxNodes = 5000;

// Neighbouring nodes share their errors (light, folds), so the scatter of a mean is judged by the means of
// squares of so many cells a side.
constexpr int kBlockCells = 16;

// Sights that no point has a part in count up to this distance from it; those further off are taken for
// wrong. A camera that was knocked has only such.
constexpr double kMaxDriftPx = 20;

struct BlockSum {
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();
  int count = 0;
};
struct CameraSums {
  std::map<std::pair<int, int>, BlockSum> blocks;
  double squared_px2 = 0;
};

struct Linearised {
  Eigen::Matrix<double, 2, 3> jacobian;
  Eigen::Vector2d residual_px;
  double weight = 0;
};

// Of the point without a sight, by the change that leaving it out makes in the linearised problem.
std::optional<Eigen::Vector2d> LeftOut(const Linearised& sight, const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix2d own = sight.weight * sight.jacobian * covariance * sight.jacobian.transpose();
  const Eigen::Matrix2d rest = Eigen::Matrix2d::Identity() - own;
  if (!(rest.determinant() > 1e-3)) return std::nullopt;  // nobody else fixes the point
  return Eigen::Vector2d(rest.inverse() * sight.residual_px);
}

void AddPoint(const CloudPoint& point, const std::vector<Sight>& sights, const TriangulationOptions& options,
              std::vector<CameraSums>* sums) {
  std::vector<int> inliers;
  InliersAt(point.position_mm, sights, options.consensus, &inliers);
  const int agreeing = static_cast<int>(inliers.size()), needed = options.consensus.min_views;
  if (agreeing < needed) return;
  const std::pair<int, int> block = {point.node.row / kBlockCells, point.node.col / kBlockCells};
  const auto add = [&](int camera, const Eigen::Vector2d& residual_px) {
    BlockSum& sum = (*sums)[camera].blocks[block];
    sum.residual_px += residual_px;
    ++sum.count;
    (*sums)[camera].squared_px2 += residual_px.squaredNorm();
  };
  // A camera that moved has no part in the point, and sees it as far off as it moved.
  for (size_t i = 0; i < sights.size(); ++i) {
    const bool agrees = std::any_of(inliers.begin(), inliers.end(),
                                    [&](int k) { return sights[k].camera == sights[i].camera; });
    if (agrees || !(sights[i].DepthMm(point.position_mm) > 0)) continue;
    const Eigen::Vector2d residual_px = -sights[i].ResidualPx(point.position_mm);
    if (residual_px.norm() <= kMaxDriftPx) add(sights[i].camera, residual_px);
  }
  if (agreeing == needed) return;  // without one of them there is no point
  std::vector<Linearised> linearised;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  for (const int i : inliers) {
    const Sight& sight = sights[i];
    Linearised l;
    l.residual_px = -sight.ResidualPx(point.position_mm);
    const double depth = sight.DepthMm(point.position_mm);
    l.jacobian = (sight.pixel_from_offset + l.residual_px * sight.axis.transpose()) / depth;
    const double sigma = std::max(sight.sigma_px, options.refinement.min_sigma_px);
    l.weight = 1 / (sigma * sigma);
    normal += l.weight * l.jacobian.transpose() * l.jacobian;
    linearised.push_back(l);
  }
  Eigen::Matrix3d covariance;
  bool invertible = false;
  normal.computeInverseWithCheck(covariance, invertible);
  if (!invertible) return;
  for (size_t k = 0; k < linearised.size(); ++k) {
    const std::optional<Eigen::Vector2d> residual = LeftOut(linearised[k], covariance);
    if (residual) add(sights[inliers[k]].camera, *residual);
  }
}

CameraBias Summarise(const CameraSums& sums) {
  CameraBias bias;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& [place, block] : sums.blocks) {
    bias.observations += block.count;
    sum += block.residual_px;
  }
  if (bias.observations == 0) return bias;
  bias.mean_px = sum / bias.observations;
  bias.rms_px = std::sqrt(sums.squared_px2 / bias.observations);
  if (sums.blocks.size() < kLeastBlocks) return bias;
  // Scatter of a ratio of sums over blocks.
  Eigen::Vector2d scatter = Eigen::Vector2d::Zero();
  for (const auto& [place, block] : sums.blocks)
    scatter += (block.residual_px - block.count * bias.mean_px).cwiseAbs2();
  const double blocks = static_cast<double>(sums.blocks.size());
  bias.mean_sigma_px = (scatter * blocks / (blocks - 1)).cwiseSqrt() / bias.observations;
  if (bias.mean_sigma_px.minCoeff() > 0)
    bias.significance = bias.mean_px.cwiseQuotient(bias.mean_sigma_px).norm();
  return bias;
}

}  // namespace

absl::StatusOr<std::vector<CameraBias>> MeasureCameraBias(const Rig& rig,
                                                          const std::vector<ViewObservations>& views,
                                                          const Cloud& cloud,
                                                          const TriangulationOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const int cameras = static_cast<int>(rig.cameras.size());
  const size_t step = std::max<size_t>(1, (cloud.points.size() + kMaxNodes - 1) / kMaxNodes);
  // Only the observations of nodes that are looked at.
  const auto is_wanted = [&](const BoardNode& node) {
    const CloudPoint* point = FindPoint(cloud, node);
    return point != nullptr && static_cast<size_t>(point - cloud.points.data()) % step == 0;
  };
  std::vector<ViewObservations> chosen;
  for (const ViewObservations& view : views) {
    if (view.camera < 0 || view.camera >= cameras)
      return absl::InvalidArgumentError(absl::StrCat("view of camera ", view.camera, ": the rig has ",
                                                     cameras, " cameras, numbered from 0"));
    ViewObservations& out = chosen.emplace_back();
    out.camera = view.camera;
    for (const Observation& o : view.observations)
      if (is_wanted(o.node)) out.observations.push_back(o);
  }
  std::vector<std::vector<UndistortedPoint>> undistorted;
  for (const ViewObservations& view : chosen)
    undistorted.push_back(UndistortAll(rig.cameras[view.camera], view.observations));
  const NodeIndex index = GroupByNode(chosen);
  std::vector<CameraSums> sums(cameras);
  size_t at = 0;
  for (size_t i = 0; i < cloud.points.size(); i += step) {
    const CloudPoint& point = cloud.points[i];
    // Both are ordered by kind, row, column.
    const auto before = [](const BoardNode& a, const BoardNode& b) {
      return std::tuple(a.kind, a.row, a.col) < std::tuple(b.kind, b.row, b.col);
    };
    while (at < index.nodes.size() && before(index.nodes[at].node, point.node)) ++at;
    if (at == index.nodes.size() || index.nodes[at].node != point.node) continue;
    std::vector<Sight> sights;
    for (size_t e = index.nodes[at].first; e < index.nodes[at].last; ++e) {
      const auto [view, place] = index.entries[e];
      if (!undistorted[view][place].valid) continue;
      const int camera = chosen[view].camera;
      sights.push_back(MakeSight(rig.cameras[camera], camera, undistorted[view][place],
                                 chosen[view].observations[place].sigma_px));
    }
    AddPoint(point, sights, options, &sums);
  }
  std::vector<CameraBias> biases;
  for (const CameraSums& camera : sums) biases.push_back(Summarise(camera));
  return biases;
}

}  // namespace weft
