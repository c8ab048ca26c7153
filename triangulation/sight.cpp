#include "triangulation/sight.h"

namespace weft {

std::vector<UndistortedPoint> UndistortAll(const CameraModel& camera,
                                           std::span<const Observation> observations) {
  std::vector<UndistortedPoint> out(observations.size());
  const Eigen::Vector3d center = camera.CenterWorld();
  for (size_t i = 0; i < observations.size(); ++i) {
    const std::optional<Eigen::Vector2d> p = camera.Undistort({observations[i].x_px, observations[i].y_px});
    if (!p) continue;
    // At depth 1 mm the derivative by the world point is d_pixel_d_point * [1 0 -x; 0 1 -y] * rotation.
    const Eigen::Vector3d at_depth_1 =
        center + camera.rotation.transpose() * Eigen::Vector3d(p->x(), p->y(), 1);
    const std::optional<Projection> projection = camera.ProjectWithDerivative(at_depth_1);
    if (!projection) continue;
    const Eigen::Matrix<double, 2, 3> by_camera = projection->d_pixel_d_world * camera.rotation.transpose();
    out[i].x = p->x();
    out[i].y = p->y();
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 2; ++c) out[i].d_pixel_d_point[2 * r + c] = static_cast<float>(by_camera(r, c));
    }
    out[i].valid = true;
  }
  return out;
}

Sight MakeSight(const CameraModel& camera, int camera_index, const UndistortedPoint& point, double sigma_px) {
  Sight sight;
  sight.camera = camera_index;
  sight.sigma_px = sigma_px;
  sight.origin_mm = camera.CenterWorld();
  sight.axis = camera.rotation.row(2);
  sight.direction = (camera.rotation.transpose() * Eigen::Vector3d(point.x, point.y, 1)).normalized();
  Eigen::Matrix<double, 2, 3> d_point_d_camera;
  d_point_d_camera << 1, 0, -point.x, 0, 1, -point.y;
  const Eigen::Matrix<float, 2, 2, Eigen::RowMajor> d_pixel_d_point(point.d_pixel_d_point);
  sight.pixel_from_offset = d_pixel_d_point.cast<double>() * d_point_d_camera * camera.rotation;
  return sight;
}

}  // namespace weft
