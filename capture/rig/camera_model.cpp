#include "capture/rig/camera_model.h"

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

// Distorted point and its Jacobian by the undistorted one (OpenCV's rational model).
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

Distorted Distort(const std::array<double, 8>& d, const Eigen::Vector2d& p) {
  const double k1 = d[0], k2 = d[1], p1 = d[2], p2 = d[3], k3 = d[4], k4 = d[5], k5 = d[6], k6 = d[7];
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double numerator = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double radial = numerator / denominator;
  const double numerator_dr2 = k1 + r2 * (2 * k2 + r2 * 3 * k3);
  const double denominator_dr2 = k4 + r2 * (2 * k5 + r2 * 3 * k6);
  const double radial_dr2 = (numerator_dr2 - radial * denominator_dr2) / denominator;

  Distorted out;
  out.point.x() = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  out.point.y() = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  out.jacobian(0, 0) = radial + 2 * x * x * radial_dr2 + 2 * p1 * y + 6 * p2 * x;
  out.jacobian(0, 1) = 2 * x * y * radial_dr2 + 2 * p1 * x + 2 * p2 * y;
  out.jacobian(1, 0) = out.jacobian(0, 1);
  out.jacobian(1, 1) = radial + 2 * y * y * radial_dr2 + 6 * p1 * y + 2 * p2 * x;
  return out;
}

// The lens model is one-to-one from the centre outwards only while the radial polynomial rises. Walking the
// segment from the centre finds a fold that lies between the centre and the point.
bool InsideFold(const std::array<double, 8>& d, const Eigen::Vector2d& p) {
  const double r2_end = p.squaredNorm();
  constexpr int kSteps = 8;
  for (int i = 1; i <= kSteps; ++i) {
    const double r2 = r2_end * i / kSteps;
    const double numerator = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double denominator = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
    if (denominator <= 0) return false;
    const double numerator_dr2 = d[0] + r2 * (2 * d[1] + r2 * 3 * d[4]);
    const double denominator_dr2 = d[5] + r2 * (2 * d[6] + r2 * 3 * d[7]);
    // By the square of the denominator, for divisions cost more than all else here.
    const double slope =
        numerator * denominator + 2 * r2 * (numerator_dr2 * denominator - numerator * denominator_dr2);
    if (!(slope > 0)) return false;
  }
  return true;
}

}  // namespace

absl::Status CameraModel::Validate() const {
  const auto bad = [this](const char* field, const std::string& why) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", id.empty() ? "(no id)" : id, ": ", field, " ", why));
  };
  if (id.empty()) return bad("id", "is empty; every camera needs one");
  if (width_px <= 0 || width_px > 65536)
    return bad("width_px", absl::StrCat("is ", width_px, ", expected 1 to 65536"));
  if (height_px <= 0 || height_px > 65536)
    return bad("height_px", absl::StrCat("is ", height_px, ", expected 1 to 65536"));
  if (!(fx_px > 0) || !std::isfinite(fx_px)) return bad("fx_px", "must be a positive number");
  if (!(fy_px > 0) || !std::isfinite(fy_px)) return bad("fy_px", "must be a positive number");
  if (!std::isfinite(cx_px)) return bad("cx_px", "is not finite");
  if (!std::isfinite(cy_px)) return bad("cy_px", "is not finite");
  for (double k : distortion) {
    if (!std::isfinite(k)) return bad("distortion", "is not finite");
  }
  if (!translation_mm.allFinite()) return bad("translation_mm", "is not finite");
  const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!rotation.allFinite() || off > 1e-4 || rotation.determinant() < 0) {
    return bad("rotation", "is not a rotation (rows must be orthonormal, determinant +1)");
  }
  return absl::OkStatus();
}

std::optional<Projection> CameraModel::ProjectWithDerivative(const Eigen::Vector3d& point_mm) const {
  const Eigen::Vector3d c = rotation * point_mm + translation_mm;
  if (!(c.z() > 1e-9)) return std::nullopt;
  const Eigen::Vector2d normalized(c.x() / c.z(), c.y() / c.z());
  if (!InsideFold(distortion, normalized)) return std::nullopt;
  const Distorted distorted = Distort(distortion, normalized);

  Projection out;
  out.depth_mm = c.z();
  out.pixel_px = {fx_px * distorted.point.x() + cx_px, fy_px * distorted.point.y() + cy_px};
  Eigen::Matrix<double, 2, 3> d_normalized_d_camera;
  d_normalized_d_camera << 1 / c.z(), 0, -normalized.x() / c.z(), 0, 1 / c.z(), -normalized.y() / c.z();
  out.d_pixel_d_world =
      Eigen::Vector2d(fx_px, fy_px).asDiagonal() * distorted.jacobian * d_normalized_d_camera * rotation;
  return out;
}

std::optional<Eigen::Vector2d> CameraModel::Project(const Eigen::Vector3d& point_mm) const {
  const Eigen::Vector3d c = rotation * point_mm + translation_mm;
  if (!(c.z() > 1e-9)) return std::nullopt;
  const Eigen::Vector2d normalized(c.x() / c.z(), c.y() / c.z());
  if (!InsideFold(distortion, normalized)) return std::nullopt;
  const Eigen::Vector2d p = Distort(distortion, normalized).point;
  return Eigen::Vector2d(fx_px * p.x() + cx_px, fy_px * p.y() + cy_px);
}

std::optional<Eigen::Vector2d> CameraModel::Undistort(const Eigen::Vector2d& pixel_px) const {
  const Eigen::Vector2d target((pixel_px.x() - cx_px) / fx_px, (pixel_px.y() - cy_px) / fy_px);
  // Newton from the distorted point; the step is halved while it does not come closer.
  Eigen::Vector2d p = target;
  Distorted at = Distort(distortion, p);
  double error = (at.point - target).norm();
  for (int i = 1; i < 50 && error >= 1e-13; ++i) {
    const double det = at.jacobian.determinant();
    if (!(std::abs(det) > 1e-9)) return std::nullopt;
    const Eigen::Vector2d step = at.jacobian.inverse() * (at.point - target);
    double scale = 1;
    const auto comes_closer = [&] {
      at = Distort(distortion, p - scale * step);
      return (at.point - target).norm() < error;
    };
    while (scale > 1e-3 && !comes_closer()) scale /= 2;
    if (scale <= 1e-3) break;
    p -= scale * step;
    error = (at.point - target).norm();
  }
  if (!(error < 1e-9) || !InsideFold(distortion, p)) return std::nullopt;
  return p;
}

std::optional<Ray> CameraModel::PixelRay(const Eigen::Vector2d& pixel_px) const {
  const std::optional<Eigen::Vector2d> p = Undistort(pixel_px);
  if (!p) return std::nullopt;
  Ray ray;
  ray.origin_mm = CenterWorld();
  ray.direction = (rotation.transpose() * Eigen::Vector3d(p->x(), p->y(), 1)).normalized();
  return ray;
}

bool CameraModel::Contains(const Eigen::Vector2d& pixel_px) const {
  return pixel_px.x() >= -0.5 && pixel_px.y() >= -0.5 && pixel_px.x() <= width_px - 0.5 &&
         pixel_px.y() <= height_px - 0.5;
}

}  // namespace weft
