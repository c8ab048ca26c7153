#include "capture/calibration/view_equations.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace weft {
namespace {

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

constexpr int kViewColumns = kViewRows - 1;  // lens, pose of the board to the camera, warp
constexpr int kPoseColumn = kLensUnknowns, kWarpColumn = kPoseColumn + 6;
using ViewDerivative = Eigen::Matrix<double, 2, kViewColumns>;

Eigen::Vector3d Vec3(const double* v) { return {v[0], v[1], v[2]}; }

// Everything of a view that its corners share.
struct ViewFrame {
  explicit ViewFrame(const ViewState& state)
      : lens(state.camera_unknowns),
        rational(&state.camera->distortion[5]),
        camera(Turn(Vec3(lens + kLensUnknowns), state.camera->rotation)),
        center_mm(Vec3(lens + kLensUnknowns + 3)),
        board(Turn(Vec3(state.pose_unknowns), state.pose->rotation)),
        board_mm(Vec3(state.pose_unknowns + 3)),
        warp(WarpWith(state.warp_unknowns)),
        shape(*state.board) {}

  const double* lens;
  const double* rational;  // k4 k5 k6, which stay as they are
  TurnedRotation camera;
  Eigen::Vector3d center_mm;
  TurnedRotation board;
  Eigen::Vector3d board_mm;
  BoardWarp warp;
  const TagBoard& shape;
};

// OpenCV's lens at the normalised point; `by_point` is d pixel / d point, `by_lens` d pixel / d lens.
Eigen::Vector2d ApplyLens(const ViewFrame& frame, const Eigen::Vector2d& p, Eigen::Matrix2d* by_point,
                          Eigen::Matrix<double, 2, kLensUnknowns>* by_lens) {
  const double fx = frame.lens[0], fy = frame.lens[1], cx = frame.lens[2], cy = frame.lens[3];
  const double k1 = frame.lens[4], k2 = frame.lens[5], p1 = frame.lens[6], p2 = frame.lens[7],
               k3 = frame.lens[8];
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double* k = frame.rational;
  const double below = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
  const double radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below;
  const double xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  if (by_point) {
    const double below_dr2 = k[0] + r2 * (2 * k[1] + r2 * 3 * k[2]);
    const double radial_dr2 = (k1 + r2 * (2 * k2 + r2 * 3 * k3) - radial * below_dr2) / below;
    const double mixed = 2 * x * y * radial_dr2 + 2 * p1 * x + 2 * p2 * y;
    *by_point << fx * (radial + 2 * x * x * radial_dr2 + 2 * p1 * y + 6 * p2 * x), fx * mixed, fy * mixed,
        fy * (radial + 2 * y * y * radial_dr2 + 6 * p1 * y + 2 * p2 * x);
    const double a = fx * x / below, b = fy * y / below, r4 = r2 * r2;
    *by_lens << xd, 0, 1, 0, a * r2, a * r4, fx * 2 * x * y, fx * (r2 + 2 * x * x), a * r2 * r4,  //
        0, yd, 0, 1, b * r2, b * r4, fy * (r2 + 2 * y * y), fy * 2 * x * y, b * r2 * r4;
  }
  return {fx * xd + cx, fy * yd + cy};
}

bool Project(const ViewFrame& frame, int corner, Eigen::Vector2d* pixel_px, ViewDerivative* derivative) {
  const Eigen::Vector2d flat = FlatCorner(frame.shape, corner).head<2>();
  const Eigen::Vector3d turned = frame.board.rotation * WarpedPoint(frame.shape, frame.warp, flat);
  const Eigen::Vector3d in_camera = frame.camera.rotation * (turned + frame.board_mm - frame.center_mm);
  const double z = in_camera.z();
  if (!(z > 1e-6)) return false;
  const Eigen::Vector2d p = in_camera.head<2>() / z;
  if (!derivative) {
    *pixel_px = ApplyLens(frame, p, nullptr, nullptr);
    return true;
  }
  Eigen::Matrix2d by_point;
  Eigen::Matrix<double, 2, kLensUnknowns> by_lens;
  *pixel_px = ApplyLens(frame, p, &by_point, &by_lens);
  Eigen::Matrix<double, 2, 3> perspective;
  perspective << 1 / z, 0, -p.x() / z, 0, 1 / z, -p.y() / z;
  const Eigen::Matrix<double, 2, 3> by_camera_point = by_point * perspective;
  derivative->leftCols<kLensUnknowns>() = by_lens;
  derivative->middleCols<3>(kPoseColumn) = -by_camera_point * Cross(in_camera);
  derivative->middleCols<3>(kPoseColumn + 3) = by_camera_point;
  derivative->middleCols<kWarpUnknowns>(kWarpColumn) =
      by_camera_point * frame.camera.rotation * frame.board.rotation * WarpDerivative(frame.shape, flat);
  return true;
}

// The columns of Project in terms of the view's unknowns: the Jacobian of the board's pose relative to the
// camera by the poses of camera and board.
Eigen::Matrix<double, kViewColumns, kViewUnknowns> ByUnknowns(const ViewFrame& frame) {
  Eigen::Matrix<double, kViewColumns, kViewUnknowns> out =
      Eigen::Matrix<double, kViewColumns, kViewUnknowns>::Zero();
  const Eigen::Matrix3d& turned = frame.camera.rotation;
  const Eigen::Vector3d board = turned * (frame.board_mm - frame.center_mm);
  constexpr int kPlacement = kCameraUnknowns;
  out.topLeftCorner<kLensUnknowns, kLensUnknowns>().setIdentity();
  out.block<3, 3>(kPoseColumn, kLensUnknowns) = frame.camera.turn_jacobian;
  out.block<3, 3>(kPoseColumn + 3, kLensUnknowns + 3) = -turned;
  out.block<3, 3>(kPoseColumn, kPlacement) = turned * frame.board.turn_jacobian;
  out.block<3, 3>(kPoseColumn + 3, kPlacement) = Cross(board) * turned * frame.board.turn_jacobian;
  out.block<3, 3>(kPoseColumn + 3, kPlacement + 3) = turned;
  out.bottomRightCorner<kWarpUnknowns, kWarpUnknowns>().setIdentity();
  return out;
}

}  // namespace

CameraUnknowns UnknownsOf(const CameraModel& camera) {
  const Eigen::Vector3d center = camera.CenterWorld();
  const auto& d = camera.distortion;
  return {camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, d[0], d[1], d[2], d[3], d[4], 0, 0, 0,
          center.x(),   center.y(),   center.z()};
}

PlacementUnknowns UnknownsOf(const RigidPose& world_from_board) {
  const Eigen::Vector3d& t = world_from_board.translation_mm;
  return {0, 0, 0, t.x(), t.y(), t.z()};
}

WarpUnknowns UnknownsOf(const BoardWarp& warp) {
  return {warp.bend_xx_mm, warp.bend_xy_mm, warp.bend_yy_mm, warp.stretch};
}

TurnedRotation Turn(const Eigen::Vector3d& turn, const Eigen::Matrix3d& rotation) {
  const double angle = turn.norm();
  if (angle < 1e-12) return {rotation, Eigen::Matrix3d::Identity()};
  const Eigen::Vector3d axis = turn / angle;
  const Eigen::Matrix3d cross = Cross(axis);
  // Rodrigues' formula and the left Jacobian of SO(3).
  const Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / angle * cross +
                                   (1 - std::sin(angle) / angle) * cross * cross;
  return {Eigen::AngleAxisd(angle, axis).toRotationMatrix() * rotation, jacobian};
}

CameraModel CameraWith(const CameraModel& camera, const double* u) {
  CameraModel out = camera;
  out.fx_px = u[0];
  out.fy_px = u[1];
  out.cx_px = u[2];
  out.cy_px = u[3];
  for (int i = 0; i < 5; ++i) out.distortion[i] = u[4 + i];
  out.rotation = Turn(Vec3(u + 9), camera.rotation).rotation;
  out.translation_mm = -out.rotation * Vec3(u + 12);
  return out;
}

RigidPose PoseWith(const RigidPose& pose, const double* u) {
  return {Turn(Vec3(u), pose.rotation).rotation, Vec3(u + 3)};
}

BoardWarp WarpWith(const double* u) { return {u[0], u[1], u[2], u[3]}; }

Eigen::Vector3d RadialPriorWeights(const CameraModel& camera) {
  constexpr double kSigmaAtCorner = 0.1;
  const Eigen::Vector3d sigma(1, 10, 100);
  const double x = std::max(camera.cx_px + 0.5, camera.width_px - 0.5 - camera.cx_px) / camera.fx_px,
               y = std::max(camera.cy_px + 0.5, camera.height_px - 0.5 - camera.cy_px) / camera.fy_px;
  const double r2 = x * x + y * y;
  const Eigen::Vector3d at_corner(r2, r2 * r2, r2 * r2 * r2);
  return (at_corner / kSigmaAtCorner).cwiseMax(sigma.cwiseInverse());
}

bool ProjectCorner(const ViewState& state, int corner, Eigen::Vector2d* pixel_px,
                   Eigen::Matrix<double, 2, kViewUnknowns>* derivative) {
  const ViewFrame frame(state);
  ViewDerivative by_view;
  if (!Project(frame, corner, pixel_px, derivative ? &by_view : nullptr)) return false;
  if (derivative) *derivative = by_view * ByUnknowns(frame);
  return true;
}

void SumView(const ViewState& state, const std::vector<BoardCorner>& corners, double sigma_px,
             double huber_sigmas, bool with_derivatives, ViewSums* sums) {
  const ViewFrame frame(state);
  sums->robust_cost = 0;
  Eigen::Matrix<double, Eigen::Dynamic, kViewRows> rows;
  if (with_derivatives) rows.setZero(std::max<Eigen::Index>(kViewRows, 2 * corners.size()), kViewRows);
  ViewDerivative derivative;
  for (size_t i = 0; i < corners.size(); ++i) {
    Eigen::Vector2d pixel;
    if (!Project(frame, corners[i].index, &pixel, with_derivatives ? &derivative : nullptr)) {
      sums->robust_cost += 1e6;  // a solution that needs this is never the better one
      continue;
    }
    const Eigen::Vector2d residual = (pixel - corners[i].pixel_px) / sigma_px;
    const double length = residual.norm();
    const bool far = length > huber_sigmas;
    sums->robust_cost += far ? huber_sigmas * (2 * length - huber_sigmas) : length * length;
    if (!with_derivatives) continue;
    const double root_weight = far ? std::sqrt(huber_sigmas / length) : 1;
    rows.block<2, kViewColumns>(2 * i, 0) = derivative * (root_weight / sigma_px);
    rows.block<2, 1>(2 * i, kViewColumns) = residual * root_weight;
  }
  if (!with_derivatives) return;
  const Eigen::HouseholderQR<Eigen::Ref<decltype(rows)>> qr(rows);
  const Eigen::Matrix<double, kViewRows, kViewRows> triangle =
      rows.topRows<kViewRows>().triangularView<Eigen::Upper>();
  sums->factor.leftCols<kViewUnknowns>().noalias() = triangle.leftCols<kViewColumns>() * ByUnknowns(frame);
  sums->factor.col(kViewUnknowns) = triangle.col(kViewColumns);
}

BundleViewState::BundleViewState(const CalibrationBundle& bundle, const BundleView& view)
    : camera_(UnknownsOf(bundle.cameras[view.camera])),
      pose_(UnknownsOf(bundle.placements[view.placement].world_from_board)),
      warp_(UnknownsOf(bundle.warps[bundle.placements[view.placement].board])) {
  const BoardPlacement& placement = bundle.placements[view.placement];
  state_ = {&bundle.cameras[view.camera],    camera_.data(), &placement.world_from_board, pose_.data(),
            &bundle.boards[placement.board], warp_.data()};
}

std::vector<Eigen::Vector2d> ViewResiduals(const CalibrationBundle& bundle, const BundleView& view) {
  const BundleViewState now(bundle, view);
  const ViewFrame frame(now.state());
  std::vector<Eigen::Vector2d> out;
  for (const BoardCorner& corner : view.corners) {
    Eigen::Vector2d pixel = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    if (Project(frame, corner.index, &pixel, nullptr)) pixel = corner.pixel_px - pixel;
    out.push_back(pixel);
  }
  return out;
}

}  // namespace weft
