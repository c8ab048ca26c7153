#include "animation/rays/view_poses.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <map>
#include <numbers>

namespace weft {
namespace {

constexpr int kTurns = 8;
// Rays of one view that are enough for a pose of its own.
constexpr int kRaysOfPose = 20;

// The pose of points from directions in which one place sees them, as if from afar: the affine map by least
// squares, brought to the nearest rotation with scale.
struct Sight {
  Eigen::Vector3d point_mm, direction;
};
Eigen::Isometry3d OrthographicPose(const std::vector<Sight>& sights, const Eigen::Vector3d& eye_mm) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
  for (const Sight& s : sights) axis += s.direction, middle += s.point_mm;
  axis.normalize();
  middle /= static_cast<double>(sights.size());
  Eigen::Matrix3d view;  // rows: across, across, along
  Eigen::Vector3d a, b;
  AcrossOf(axis, &a, &b);
  view << a.transpose(), b.transpose(), axis.transpose();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 2, 3> mixed = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::Vector2d image_middle = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> image;
  for (const Sight& s : sights) {
    const Eigen::Vector3d in_view = view * s.direction;
    image.push_back(in_view.head<2>() / std::max(in_view.z(), 0.1));
    image_middle += image.back() / static_cast<double>(sights.size());
  }
  for (size_t i = 0; i < sights.size(); ++i) {
    const Eigen::Vector3d p = sights[i].point_mm - middle;
    normal += p * p.transpose();
    mixed += (image[i] - image_middle) * p.transpose();
  }
  normal.diagonal().array() += 1e-6 * normal.trace();
  const Eigen::Matrix<double, 2, 3> map = normal.ldlt().solve(mixed.transpose()).transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Eigen::MatrixXd(map),
                                              Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::Matrix<double, 2, 3> two = svd.matrixU() * svd.matrixV().transpose();
  Eigen::Matrix3d rotation;  // of the view from the points
  rotation.topRows<2>() = two;
  rotation.row(2) = two.row(0).cross(two.row(1));
  const double scale = std::max(1e-9, 0.5 * svd.singularValues().sum());  // one over the distance
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = view.transpose() * rotation;
  const Eigen::Vector3d there =
      eye_mm + view.transpose() * (Eigen::Vector3d(image_middle.x(), image_middle.y(), 1) / scale);
  out.translation() = there - out.linear() * middle;
  return out;
}

}  // namespace

std::vector<Eigen::Isometry3d> PosesFromViews(const std::vector<VertexRay>& rays,
                                              const std::vector<Eigen::Vector3d>& points_mm,
                                              const Eigen::Vector3d& turn_axis) {
  std::map<int, std::vector<Sight>> views;
  std::map<int, Eigen::Vector3d> eyes;
  for (size_t i = 0; i < rays.size(); ++i) {
    views[rays[i].view].push_back({points_mm[i], rays[i].direction});
    eyes[rays[i].view] = rays[i].origin_mm;
  }
  std::vector<Eigen::Isometry3d> out;
  for (const auto& [view, sights] : views) {
    if (static_cast<int>(sights.size()) < kRaysOfPose) continue;
    const Eigen::Isometry3d pose = OrthographicPose(sights, eyes[view]);
    for (int turn = 0; turn < kTurns; ++turn) {
      const Eigen::AngleAxisd about(turn * 2 * std::numbers::pi / kTurns, turn_axis);
      out.push_back(pose * about);
    }
  }
  return out;
}

Eigen::Vector3d LongAxis(const std::vector<Eigen::Vector3d>& points_mm) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) spread += p * p.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
}

}  // namespace weft
