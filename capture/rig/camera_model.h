// Pinhole camera with OpenCV's lens model, in both directions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace weft {

// A half line in world coordinates; `direction` has length 1.
struct Ray {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

// A pixel with its derivative by the world point, [2, 3] in px per mm.
struct Projection {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, 3> d_pixel_d_world = Eigen::Matrix<double, 2, 3>::Zero();
  double depth_mm = 0;
};

// A calibrated camera. It looks along +z, x points right and y down; pixel (0, 0) is the centre of the
// top-left pixel. `distortion` holds OpenCV's k1 k2 p1 p2 k3 k4 k5 k6 (rational model; unused terms are 0).
// Thread safety: const functions may be called from any number of threads.
struct CameraModel {
  std::string id;
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0;
  double fy_px = 0;
  double cx_px = 0;
  double cy_px = 0;
  std::array<double, 8> distortion{};
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();    // camera_from_world
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();  // camera_from_world

  // Sizes positive, focal lengths positive, numbers finite, rotation orthonormal with determinant 1.
  // InvalidArgument names the camera and the field.
  absl::Status Validate() const;

  Eigen::Vector3d CenterWorld() const { return -rotation.transpose() * translation_mm; }

  // World point (mm) to pixel. Empty for points at or behind the camera plane. Empty also far outside the
  // image, where the lens polynomial folds back and would map points into the image again.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_mm) const;
  std::optional<Projection> ProjectWithDerivative(const Eigen::Vector3d& point_mm) const;

  // Pixel to the undistorted point on the plane z = 1 of the camera; the inverse of Project to 1e-9 of the
  // focal length. Empty where the lens model has no inverse.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& pixel_px) const;

  // Viewing ray of a pixel in world coordinates, empty as Undistort.
  std::optional<Ray> PixelRay(const Eigen::Vector2d& pixel_px) const;

  // True if the pixel lies on the sensor, half a pixel of border included.
  bool Contains(const Eigen::Vector2d& pixel_px) const;
};

}  // namespace weft
