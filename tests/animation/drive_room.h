// Cameras around a garment, and what they see of it without any occlusion: for tests with closed forms.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "animation/rays/evidence.h"
#include "base/counter_random.h"
#include "capture/rig/camera_model.h"

namespace weft {

// Looks at a point from a distance, azimuth 0 from -z, y down.
inline CameraModel CameraAt(const std::string& id, double azimuth_deg, const Eigen::Vector3d& aim_mm,
                            double distance_mm = 2200) {
  CameraModel camera;
  camera.id = id;
  camera.width_px = 960, camera.height_px = 1280;
  camera.fx_px = camera.fy_px = 2600;
  camera.cx_px = 480, camera.cy_px = 640;
  const double a = azimuth_deg * std::numbers::pi / 180;
  const Eigen::Vector3d from = aim_mm + distance_mm * Eigen::Vector3d(std::sin(a), 0, -std::cos(a));
  const Eigen::Vector3d ahead = (aim_mm - from).normalized(), down = Eigen::Vector3d::UnitY();
  camera.rotation << down.cross(ahead).normalized().transpose(), down.transpose(), ahead.transpose();
  camera.translation_mm = -camera.rotation * from;
  return camera;
}

// The same camera after everything was moved.
inline CameraModel Moved(CameraModel camera, const Eigen::Isometry3d& motion) {
  const Eigen::Vector3d center = motion * camera.CenterWorld();
  camera.rotation = camera.rotation * motion.linear().transpose();
  camera.translation_mm = -camera.rotation * center;
  return camera;
}

}  // namespace weft
