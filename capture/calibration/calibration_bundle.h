// The unknowns of a rig calibration and what was measured of them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "capture/calibration/board_view.h"
#include "capture/calibration/target.h"
#include "capture/rig/camera_model.h"

namespace weft {

// x_target = rotation * x_source + translation_mm.
struct RigidPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation_mm; }
  RigidPose operator*(const RigidPose& other) const {
    return {rotation * other.rotation, rotation * other.translation_mm + translation_mm};
  }
  RigidPose Inverse() const { return {rotation.transpose(), -rotation.transpose() * translation_mm}; }
};

inline RigidPose CameraFromWorld(const CameraModel& camera) {
  return {camera.rotation, camera.translation_mm};
}
inline void SetCameraFromWorld(const RigidPose& pose, CameraModel* camera) {
  camera->rotation = pose.rotation;
  camera->translation_mm = pose.translation_mm;
}

// A board at the moment of one frame.
struct BoardPlacement {
  int frame = 0;
  int board = 0;
  RigidPose world_from_board;
};

// One board in one image, ready for adjustment.
struct BundleView {
  int camera = 0;
  int placement = 0;
  std::vector<BoardCorner> corners;
  bool straight_sides = false;  // of BoardView
};

struct CalibrationBundle {
  std::vector<TagBoard> boards;
  std::vector<BoardWarp> warps;  // [boards]
  std::vector<CameraModel> cameras;
  std::vector<double> sigma_px;  // [cameras], of a corner's coordinate
  std::vector<BoardPlacement> placements;
  std::vector<BundleView> views;
};

// Measured minus projected pixel of every corner of the view; NaN for points behind the camera.
std::vector<Eigen::Vector2d> ViewResiduals(const CalibrationBundle& bundle, const BundleView& view);

}  // namespace weft
