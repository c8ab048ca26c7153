#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/results/report/mesh_view.h"

namespace weft {
namespace {

// Beyond this cosine between the narrowest axis and up, the vertices lie flat.
constexpr double kLyingCosine = 0.85;
// A shape whose depth is more than this share of its width has no broad side.
constexpr double kRoundShare = 0.8;

Eigen::Vector3d AwayFromFrontViewer(const Eigen::Vector3d& up) {
  const Eigen::Vector3d axis = std::abs(up.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
  return (axis - axis.dot(up) * up).normalized();
}

absl::StatusOr<Eigen::Matrix3d> CovarianceOf(const std::vector<Eigen::Vector3d>& vertices_mm) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < vertices_mm.size(); ++i) {
    if (!vertices_mm[i].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", i, ": its position is not finite"));
    }
    mean += vertices_mm[i];
  }
  mean /= static_cast<double>(vertices_mm.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : vertices_mm) covariance += (p - mean) * (p - mean).transpose();
  return Eigen::Matrix3d(covariance / static_cast<double>(vertices_mm.size()));
}

// The horizontal direction along which the shape is narrowest, away from a viewer in front.
Eigen::Vector3d LevelDepthAxis(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& up) {
  const Eigen::Vector3d away = AwayFromFrontViewer(up);
  Eigen::Matrix<double, 3, 2> level;
  level << away, up.cross(away);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(
      Eigen::Matrix2d(level.transpose() * covariance * level));
  const double depth = axes.eigenvalues()[0], width = axes.eigenvalues()[1];
  if (!(depth < kRoundShare * kRoundShare * width)) return away;
  const Eigen::Vector3d axis = level * axes.eigenvectors().col(0);
  return axis.dot(away) < 0 ? Eigen::Vector3d(-axis) : axis;
}

}  // namespace

absl::StatusOr<Viewpoint> ViewpointOf(const std::vector<Eigen::Vector3d>& vertices_mm, MeshSide side,
                                      const Eigen::Vector3d& up) {
  if (vertices_mm.empty()) return absl::InvalidArgumentError("the mesh has no vertices");
  if (!up.allFinite() || !(up.norm() > 1e-9)) {
    return absl::InvalidArgumentError("up: has no direction; give a vector that is not zero");
  }
  WEFT_ASSIGN_OR_RETURN(const Eigen::Matrix3d covariance, CovarianceOf(vertices_mm));
  Viewpoint view;
  view.up = up.normalized();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  const bool flat = axes.eigenvalues()[0] < 0.25 * axes.eigenvalues()[1];
  if (flat && std::abs(axes.eigenvectors().col(0).dot(view.up)) > kLyingCosine) {
    view.towards_viewer = view.up;
    view.up = AwayFromFrontViewer(view.towards_viewer);
  } else {
    view.towards_viewer = -LevelDepthAxis(covariance, view.up);
  }
  if (side == MeshSide::kBack) view.towards_viewer = -view.towards_viewer;
  view.right = view.up.cross(view.towards_viewer).normalized();
  return view;
}

}  // namespace weft
