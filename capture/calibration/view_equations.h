// The least-squares equations of one board in one image, with analytic derivatives.
#pragma once

#include <Eigen/Core>
#include <array>

#include "capture/calibration/calibration_bundle.h"

namespace weft {

// Unknowns of a camera: fx fy cx cy k1 k2 p1 p2 k3, a rotation vector about its own axes (left of its
// rotation), its centre in world mm. Unknowns of a placement: a rotation vector about world axes (left of
// its rotation), its translation in mm. Rotation vectors start at zero, close to the point of
// linearisation.
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

// Weights of k1, k2 and k3. At one sigma, no term moves the furthest corner of the image by more than a
// tenth of its distance from the principal point. The coefficients refer to tangents of angles, so they
// are similar for any focal length. The sigmas are 1, 10 and 100; the 211 cameras of a real studio have
// .24, .63 and 0 at most. Well covered images determine these terms thousands of times better. Where
// boards did not reach the corners, much larger terms cancel each other over the centre and shift
// principal point and pose. In long lenses they make the principal point seem to be known.
Eigen::Vector3d RadialPriorWeights(const CameraModel& camera);

// One view only tells where the board lies to the camera: lens, that pose and the warp, and the residual.
inline constexpr int kViewRows = kLensUnknowns + 6 + kWarpUnknowns + 1;

// All corners of a view together, with residuals r in units of sigma and Huber's weights. `factor` F has
// the columns camera, placement, warp, residual, and F^T F = [J r]^T [J r]. The robust cost is the sum of
// Huber's loss (not halved). F is the triangle of a QR decomposition in terms of the board's pose relative
// to the camera. The normal equations of single views are too ill-conditioned to be factored (their
// rounding errors reach a tenth of a per cent of the cost).
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
