#include "capture/rig/lens_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Where decoding has 0.1 px, this much of a lens does not show.
constexpr double kMostErrorPx = 0.05;
constexpr double kLargestAngleRad = 80 * std::numbers::pi / 180;

// The largest distance of a corner of the image from the principal point, for a focal length of 1.
double LargestRadius(const CameraModel& camera) {
  double largest = 0;
  for (const double x : {-0.5, camera.width_px - 0.5}) {
    for (const double y : {-0.5, camera.height_px - 0.5}) {
      largest =
          std::max(largest, std::hypot((x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px));
    }
  }
  return largest;
}

// Rays that the image shows, by the tangent of their angle, and where they are seen.
struct Samples {
  std::vector<double> tangent, radius;
};

absl::StatusOr<Samples> SampleImage(const RadiusOfAngle& radius, double largest) {
  constexpr int kSteps = 4000, kEvery = 10;
  Samples samples;
  double last = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double angle = kLargestAngleRad * i / kSteps, r = radius(angle);
    if (!(r > last)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "the lens folds back at %.0f degrees, within the image; are these the numbers of its model?",
          angle * 180 / std::numbers::pi));
    }
    last = r;
    if (i % kEvery == 0 || r >= largest) {
      samples.tangent.push_back(std::tan(angle));
      samples.radius.push_back(r);
    }
    if (r >= largest) return samples;
  }
  return absl::InvalidArgumentError(
      "corners of its image are more than 80 degrees off the axis, where Weft's lenses end; undistort the "
      "pictures to "
      "a pinhole camera (cv::fisheye::undistortImage) and import that one");
}

// a1 a2 a3 b1 b2 b3 of radius = x (1 + a1 s + a2 s^2 + a3 s^3) / (1 + b1 s + ...), s = (x / x_max)^2.
Eigen::Matrix<double, 6, 1> FitRational(const Samples& samples) {
  constexpr int kRounds = 20;
  const auto rows = static_cast<Eigen::Index>(samples.tangent.size());
  const double most = samples.tangent.back();
  Eigen::Matrix<double, Eigen::Dynamic, 6> a(rows, 6);
  Eigen::VectorXd b(rows);
  Eigen::VectorXd denominator = Eigen::VectorXd::Ones(rows);
  Eigen::Matrix<double, 6, 1> found = Eigen::Matrix<double, 6, 1>::Zero();
  for (int round = 0; round < kRounds; ++round) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double x = samples.tangent[i], s = x * x / (most * most), f = samples.radius[i] / x;
      const double weight = x / denominator[i];
      a.row(i) << s, s * s, s * s * s, -f * s, -f * s * s, -f * s * s * s;
      a.row(i) *= weight;
      b[i] = weight * (f - 1);
    }
    found = a.colPivHouseholderQr().solve(b);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double x = samples.tangent[i], s = x * x / (most * most);
      denominator[i] = std::max(1e-6, 1 + s * (found[3] + s * (found[4] + s * found[5])));
    }
  }
  return found;
}

double ErrorPx(const RadiusOfAngle& radius, double largest_tangent, const CameraModel& camera) {
  constexpr int kSteps = 1000;
  double error_px = 0;
  CameraModel plain = camera;
  plain.rotation.setIdentity(), plain.translation_mm.setZero();
  for (int i = 1; i <= kSteps; ++i) {
    const double angle = std::atan(largest_tangent) * i / kSteps;
    const auto seen = plain.Project({std::tan(angle), 0, 1});
    const auto down = plain.Project({0, std::tan(angle), 1});
    if (!seen || !down) return std::numeric_limits<double>::infinity();
    error_px = std::max(error_px, std::abs(seen->x() - camera.cx_px - camera.fx_px * radius(angle)));
    error_px = std::max(error_px, std::abs(down->y() - camera.cy_px - camera.fy_px * radius(angle)));
  }
  return error_px;
}

}  // namespace

absl::Status SetOpenCvDistortion(const std::vector<double>& coefficients, CameraModel* camera) {
  const size_t count = coefficients.size();
  if (count != 0 && (count < 4 || count > 8) && count != 12 && count != 14) {
    return absl::InvalidArgumentError(
        absl::StrCat("has ", count, " distortion coefficients, OpenCV's models have 4, 5, 8, 12 or 14"));
  }
  const auto any = [&](size_t begin, size_t end) {
    return std::any_of(coefficients.begin() + std::min(begin, count),
                       coefficients.begin() + std::min(end, count), [](double k) { return k != 0; });
  };
  if (any(8, 12)) {
    return absl::InvalidArgumentError(
        "its thin prism coefficients s1 s2 s3 s4 are not zero, and Weft's lenses have none; calibrate "
        "without "
        "CALIB_THIN_PRISM_MODEL");
  }
  if (any(12, 14)) {
    return absl::InvalidArgumentError(
        "its sensor is tilted (tau_x, tau_y are not zero), and Weft's lenses have no such term; calibrate "
        "without "
        "CALIB_TILTED_MODEL");
  }
  camera->distortion.fill(0);
  std::copy_n(coefficients.begin(), std::min<size_t>(count, 8), camera->distortion.begin());
  return absl::OkStatus();
}

RadiusOfAngle FisheyeRadius(std::vector<double> k) {
  k.resize(4, 0);
  return [k = std::move(k)](double angle) {
    const double a2 = angle * angle;
    return angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
  };
}

RadiusOfAngle FovRadius(double omega_rad) {
  if (omega_rad == 0) return [](double angle) { return std::tan(angle); };
  return [omega_rad](double angle) {
    return std::atan(2 * std::tan(angle) * std::tan(omega_rad / 2)) / omega_rad;
  };
}

absl::StatusOr<double> FitLens(const RadiusOfAngle& radius, CameraModel* camera) {
  camera->distortion.fill(0);
  if (!(camera->fx_px > 0) || !(camera->fy_px > 0) || camera->width_px <= 0 || camera->height_px <= 0) {
    return absl::InvalidArgumentError("needs positive focal lengths and a size of the image");
  }
  // Weft's lenses have the scale 1 on the axis; the focal length takes what another one has.
  constexpr double kNearAxisRad = 1e-5;
  const double scale = radius(kNearAxisRad) / kNearAxisRad;
  const RadiusOfAngle of_scale_1 = [&](double angle) { return radius(angle) / scale; };
  camera->fx_px *= scale, camera->fy_px *= scale;
  WEFT_ASSIGN_OR_RETURN(const Samples samples, SampleImage(of_scale_1, LargestRadius(*camera)));
  const Eigen::Matrix<double, 6, 1> found = FitRational(samples);
  const double most = samples.tangent.back(), per_r2 = 1 / (most * most);
  constexpr std::array<int, 3> kNumerator = {0, 1, 4}, kDenominator = {5, 6, 7};
  double power = 1;
  for (int i = 0; i < 3; ++i) {
    power *= per_r2;
    camera->distortion[kNumerator[i]] = power * found[i];
    camera->distortion[kDenominator[i]] = power * found[3 + i];
  }
  const double error_px = ErrorPx(of_scale_1, most, *camera);
  if (error_px <= kMostErrorPx) return error_px;
  return absl::InvalidArgumentError(absl::StrFormat(
      "Weft's rational lens holds it to %.3g px only; undistort the pictures to a pinhole camera "
      "(cv::fisheye::undistortImage) and import that one",
      error_px));
}

}  // namespace weft
