#include "capture/calibration/rig_covariance.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "capture/calibration/view_equations.h"

namespace weft {
namespace {

constexpr int kPlacementFirst = kCameraUnknowns, kWarpFirst = kCameraUnknowns + kPlacementUnknowns;

using ViewNormal = Eigen::Matrix<double, kViewUnknowns + 1, kViewUnknowns + 1>;

// J^T J of every view.
std::vector<ViewNormal> ViewNormals(const CalibrationBundle& bundle, double huber_sigmas) {
  std::vector<ViewNormal> out(bundle.views.size());
  tbb::parallel_for(size_t{0}, out.size(), [&](size_t v) {
    const BundleView& view = bundle.views[v];
    const BundleViewState now(bundle, view);
    ViewSums sums;
    SumView(now.state(), view.corners, bundle.sigma_px[view.camera], huber_sigmas, true, &sums);
    out[v].noalias() = sums.factor.transpose() * sums.factor;
  });
  return out;
}

// Adds what the views of one placement say of its cameras and the warp of its board: the Schur complement of
// its pose. `cameras`: their unknowns, which come first in the matrix.
void AddPlacement(const CalibrationBundle& bundle, const std::vector<ViewNormal>& normals, size_t placement,
                  const std::vector<size_t>& views, Eigen::Index cameras, Eigen::MatrixXd& matrix) {
  // Rows of the unknowns that meet in this placement: its cameras, then the warp of its board.
  const Eigen::Index count = static_cast<Eigen::Index>(views.size()) * kCameraUnknowns + kWarpUnknowns;
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(count, count),
                  cross = Eigen::MatrixXd::Zero(count, kPlacementUnknowns);
  Eigen::Matrix<double, kPlacementUnknowns, kPlacementUnknowns> pose =
      Eigen::Matrix<double, kPlacementUnknowns, kPlacementUnknowns>::Zero();
  const Eigen::Index warp = count - kWarpUnknowns;
  std::vector<Eigen::Index> row_of(count);
  for (size_t k = 0; k < views.size(); ++k) {
    const ViewNormal& n = normals[views[k]];
    const Eigen::Index at = static_cast<Eigen::Index>(k) * kCameraUnknowns;
    own.block<kCameraUnknowns, kCameraUnknowns>(at, at) = n.topLeftCorner<kCameraUnknowns, kCameraUnknowns>();
    own.block<kCameraUnknowns, kWarpUnknowns>(at, warp) =
        n.block<kCameraUnknowns, kWarpUnknowns>(0, kWarpFirst);
    own.block<kWarpUnknowns, kCameraUnknowns>(warp, at) =
        n.block<kWarpUnknowns, kCameraUnknowns>(kWarpFirst, 0);
    own.block<kWarpUnknowns, kWarpUnknowns>(warp, warp) +=
        n.block<kWarpUnknowns, kWarpUnknowns>(kWarpFirst, kWarpFirst);
    cross.middleRows<kCameraUnknowns>(at) = n.block<kCameraUnknowns, kPlacementUnknowns>(0, kPlacementFirst);
    cross.middleRows<kWarpUnknowns>(warp) +=
        n.block<kWarpUnknowns, kPlacementUnknowns>(kWarpFirst, kPlacementFirst);
    pose += n.block<kPlacementUnknowns, kPlacementUnknowns>(kPlacementFirst, kPlacementFirst);
    for (int i = 0; i < kCameraUnknowns; ++i)
      row_of[at + i] = bundle.views[views[k]].camera * kCameraUnknowns + i;
  }
  for (int i = 0; i < kWarpUnknowns; ++i)
    row_of[warp + i] = cameras + bundle.placements[placement].board * kWarpUnknowns + i;
  own.noalias() -= cross * pose.ldlt().solve(cross.transpose());
  for (Eigen::Index j = 0; j < count; ++j) {
    for (Eigen::Index i = 0; i < count; ++i) matrix(row_of[i], row_of[j]) += own(i, j);
  }
}

// Shifts and turns of the world about the middle of the cameras, as changes of the cameras' unknowns.
Eigen::MatrixXd WorldMotions(const CalibrationBundle& bundle, int unknowns) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const CameraModel& camera : bundle.cameras) middle += camera.CenterWorld() / bundle.cameras.size();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(unknowns, 6);
  for (size_t c = 0; c < bundle.cameras.size(); ++c) {
    const Eigen::Index at = static_cast<Eigen::Index>(c) * kCameraUnknowns + kLensUnknowns;
    const Eigen::Vector3d arm = bundle.cameras[c].CenterWorld() - middle;
    out.block<3, 3>(at, 0) = -bundle.cameras[c].rotation;
    for (int axis = 0; axis < 3; ++axis)
      out.block<3, 1>(at + 3, axis) = Eigen::Vector3d::Unit(axis).cross(arm);
    out.block<3, 3>(at + 3, 3).setIdentity();
  }
  return out;
}

}  // namespace

RigInformation ReduceToRig(const CalibrationBundle& bundle, double huber_sigmas) {
  const std::vector<ViewNormal> normals = ViewNormals(bundle, huber_sigmas);
  const Eigen::Index cameras = static_cast<Eigen::Index>(bundle.cameras.size()) * kCameraUnknowns;
  const Eigen::Index unknowns = cameras + static_cast<Eigen::Index>(bundle.warps.size()) * kWarpUnknowns;
  RigInformation out;
  out.matrix = Eigen::MatrixXd::Zero(unknowns, unknowns);
  std::vector<std::vector<size_t>> of_placement(bundle.placements.size());
  for (size_t v = 0; v < bundle.views.size(); ++v) of_placement[bundle.views[v].placement].push_back(v);
  for (size_t p = 0; p < bundle.placements.size(); ++p)
    if (!of_placement[p].empty()) AddPlacement(bundle, normals, p, of_placement[p], cameras, out.matrix);
  for (size_t c = 0; c < bundle.cameras.size(); ++c) {
    const Eigen::Vector3d weights = RadialPriorWeights(bundle.cameras[c]);
    for (int i = 0; i < 3; ++i) {
      const Eigen::Index at = static_cast<Eigen::Index>(c) * kCameraUnknowns + kRadialUnknowns[i];
      out.matrix(at, at) += weights[i] * weights[i];
    }
  }
  out.gauge = WorldMotions(bundle, static_cast<int>(unknowns));
  out.on_images = Eigen::MatrixXd::Zero(unknowns, 6);
  for (size_t v = 0; v < bundle.views.size(); ++v) {
    const Eigen::Index at = static_cast<Eigen::Index>(bundle.views[v].camera) * kCameraUnknowns;
    out.on_images.middleRows<kCameraUnknowns>(at) +=
        normals[v].topLeftCorner<kCameraUnknowns, kCameraUnknowns>() *
        out.gauge.middleRows<kCameraUnknowns>(at);
  }
  return out;
}

Eigen::MatrixXd FreeNetworkCovariance(const RigInformation& information, double variance_factor) {
  const Eigen::Index n = information.matrix.rows();
  // In units in which every unknown alone has information 1.
  const Eigen::VectorXd diagonal = information.matrix.diagonal();
  if (!(diagonal.minCoeff() > 0)) return {};
  const Eigen::VectorXd unit = diagonal.cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd motions = unit.cwiseInverse().asDiagonal() * information.gauge;
  const Eigen::Matrix<double, 6, 6> lengths = motions.transpose() * motions;
  lengths.llt().matrixU().solveInPlace<Eigen::OnTheRight>(motions);  // now orthonormal
  Eigen::MatrixXd fixed = unit.asDiagonal() * information.matrix * unit.asDiagonal();
  fixed.noalias() += motions * motions.transpose();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(fixed);
  if (cholesky.info() != Eigen::Success) return {};
  Eigen::MatrixXd covariance = cholesky.solve(Eigen::MatrixXd::Identity(n, n));
  covariance = unit.asDiagonal() * covariance * unit.asDiagonal();
  // I - G (B^T G)^-1 B^T with the gauge G and its effect on the images B.
  const Eigen::Matrix<double, 6, 6> both = information.on_images.transpose() * information.gauge;
  const Eigen::MatrixXd to_motion = both.ldlt().solve(information.on_images.transpose());
  covariance -= (covariance * to_motion.transpose()) * information.gauge.transpose();
  covariance -= information.gauge * (to_motion * covariance);
  return variance_factor * 0.5 * (covariance + covariance.transpose());
}

double ProjectionSigmaPx(const CameraModel& camera, const Eigen::MatrixXd& covariance,
                         const Eigen::Vector3d& point_mm) {
  const std::optional<Eigen::Vector2d> pixel = camera.Project(point_mm);
  if (!pixel || !camera.Contains(*pixel)) return std::numeric_limits<double>::quiet_NaN();
  // A point is a board of one tag whose first corner lies there.
  TagBoard point;
  point.rows = point.cols = 1;
  point.tag_mm = 2e-6;
  point.tag_ids = {0};
  const RigidPose pose{Eigen::Matrix3d::Identity(), point_mm};
  const CameraUnknowns camera_unknowns = UnknownsOf(camera);
  const PlacementUnknowns pose_unknowns = UnknownsOf(pose);
  const WarpUnknowns warp_unknowns{};
  const ViewState state{&camera, camera_unknowns.data(), &pose, pose_unknowns.data(),
                        &point,  warp_unknowns.data()};
  Eigen::Vector2d at;
  Eigen::Matrix<double, 2, kViewUnknowns> derivative;
  if (!ProjectCorner(state, 0, &at, &derivative)) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix<double, 2, kCameraUnknowns> by_camera = derivative.leftCols<kCameraUnknowns>();
  return std::sqrt((by_camera * covariance * by_camera.transpose()).trace() / 2);
}

}  // namespace weft
