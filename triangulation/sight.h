// What one observation says about the position of its node.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "capture/rig/camera_model.h"
#include "pattern/observation.h"

namespace weft {

// An undistorted observation. The pixel residual of a world point X is pixel_from_offset * (X - origin) /
// depth(X). It is exact up to the curvature of the lens model over the length of the residual (below 1e-5
// px for residuals of a pixel).
struct Sight {
  int camera = 0;
  double sigma_px = 0;
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // length 1
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();       // optical axis: depth(X) = axis . (X - origin)
  Eigen::Matrix<double, 2, 3> pixel_from_offset = Eigen::Matrix<double, 2, 3>::Zero();

  double DepthMm(const Eigen::Vector3d& point_mm) const { return axis.dot(point_mm - origin_mm); }
  // Defined for points in front of the camera.
  Eigen::Vector2d ResidualPx(const Eigen::Vector3d& point_mm) const {
    const Eigen::Vector3d offset = point_mm - origin_mm;
    return pixel_from_offset * offset / axis.dot(offset);
  }
  double SquaredDistanceMm2(const Eigen::Vector3d& point_mm) const {
    const Eigen::Vector3d offset = point_mm - origin_mm;
    return (offset - direction * direction.dot(offset)).squaredNorm();
  }
};

// The undistorted image point of an observation on the plane z = 1, with the derivative of the pixel by it.
// `valid` is false where the lens model has no inverse.
struct UndistortedPoint {
  double x = 0, y = 0;
  float d_pixel_d_point[4] = {0, 0, 0, 0};  // row-major, [2, 2]
  bool valid = false;
};

// One entry per observation.
std::vector<UndistortedPoint> UndistortAll(const CameraModel& camera,
                                           std::span<const Observation> observations);

Sight MakeSight(const CameraModel& camera, int camera_index, const UndistortedPoint& point, double sigma_px);

}  // namespace weft
