// The least-squares equations of one board in one image, with analytic derivatives.
#pragma once

#include <Eigen/Core>
#include <array>

#include "capture/calibration/calibration_bundle.h"

namespace weft {

// Unknowns of a camera: fx fy cx cy k1 k2 p1 p2 k3, a turn of the camera about its own axes (rotation vector,
// left of its rotation), its centre in world mm. Of a placement: a turn about world axes (left of its
// rotation), its translation in mm. Turns start at zero, so that no rotation is far from the one at which it
// is linearised.
inline constexpr int kLensUnknowns = 9;
inline constexpr int kCameraUnknowns = 15;
inline constexpr int kPlacementUnknowns = 6;
inline constexpr int kViewUnknowns = kCameraUnknowns + kPlacementUnknowns + kWarpUnknowns;

inline constexpr std::array<int, 3> kRadialUnknowns = {4, 5, 8};  // k1 k2 k3

using CameraUnknowns = std::array<double, kCameraUnknowns>;
using PlacementUnknowns = std::array<double, kPlacementUnknowns>;
using WarpUnknowns = std::array<double, kWarpUnknowns>;

CameraUnknowns UnknownsOf(const CameraModel& camera);
PlacementUnknowns UnknownsOf(const RigidPose& world_from_board);
WarpUnknowns UnknownsOf(const BoardWarp& warp);

// A rotation with the derivative of a turn: d (R x) / d turn = -[R x]_x turn_jacobian.
struct TurnedRotation {
  Eigen::Matrix3d rotation;
  Eigen::Matrix3d turn_jacobian;
};
TurnedRotation Turn(const Eigen::Vector3d& turn, const Eigen::Matrix3d& rotation);

// `camera` and `pose` with these unknowns in place of their numbers.
CameraModel CameraWith(const CameraModel& camera, const double* unknowns);
RigidPose PoseWith(const RigidPose& pose, const double* unknowns);
BoardWarp WarpWith(const double* unknowns);

// Where the unknowns of a view stand, and the rotations that its turns start from.
struct ViewState {
  const CameraModel* camera = nullptr;
  const double* camera_unknowns = nullptr;  // [kCameraUnknowns]
  const RigidPose* pose = nullptr;
  const double* pose_unknowns = nullptr;  // [kPlacementUnknowns]
  const TagBoard* board = nullptr;
  const double* warp_unknowns = nullptr;  // [kWarpUnknowns]
};

// The state of a view of a bundle as it stands: unknowns at the bundle's own numbers. Valid as long as the
// bundle.
class BundleViewState {
 public:
  BundleViewState(const CalibrationBundle& bundle, const BundleView& view);
  BundleViewState(const BundleViewState&) = delete;
  BundleViewState& operator=(const BundleViewState&) = delete;

  const ViewState& state() const { return state_; }

 private:
  CameraUnknowns camera_;
  PlacementUnknowns pose_;
  WarpUnknowns warp_;
  ViewState state_;
};

// Weights of k1, k2 and k3. None of their terms is expected to move the furthest corner of the picture by
// more than a tenth of its distance from the principal point (one sigma), and the coefficients, which belong
// to tangents of angles, are about as large for any focal length: sigmas 1, 10 and 100, where the 211 cameras
// of a real studio have .24, .63 and 0 at most. Pictures that boards covered well know these terms thousands
// of times better. Where boards did not reach the corners, terms many times as large cancel each other over
// the middle and take the principal point and the pose along; in long lenses they make the principal point
// seem to be known.
Eigen::Vector3d RadialPriorWeights(const CameraModel& camera);

// One view only tells where the board lies to the camera: lens, that pose and the warp, and the residual.
inline constexpr int kViewRows = kLensUnknowns + 6 + kWarpUnknowns + 1;

// All corners of a view together, with residuals r in units of sigma and Huber's weights: `factor` F has the
// columns camera, placement, warp, residual, and F^T F = [J r]^T [J r]; and the robust cost, sum of Huber's
// loss (not halved). F is the triangle of a QR decomposition in terms of the board's pose to the camera: the
// normal equations of single views are too badly conditioned to be factored (their rounding errors make up a
// tenth of a per cent of the cost).
struct ViewSums {
  Eigen::Matrix<double, kViewRows, kViewUnknowns + 1> factor;
  double robust_cost = 0;
};
void SumView(const ViewState& state, const std::vector<BoardCorner>& corners, double sigma_px,
             double huber_sigmas, bool with_derivatives, ViewSums* sums);

// Pixel of a corner by the state's unknowns, and its derivative by them where wanted; false behind the
// camera.
bool ProjectCorner(const ViewState& state, int corner, Eigen::Vector2d* pixel_px,
                   Eigen::Matrix<double, 2, kViewUnknowns>* derivative);

}  // namespace weft
