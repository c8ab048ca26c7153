#include "capture/calibration/scale_bars.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

namespace weft {
namespace {

// The point nearest to the rays, in the sense of least squares; refined in pixels.
std::optional<Eigen::Vector3d> PointOf(const std::vector<const BarEndView*>& sights,
                                       const std::vector<CameraModel>& cameras) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  int rays = 0;
  for (const BarEndView* sight : sights) {
    const std::optional<Ray> ray = cameras[sight->camera].PixelRay(sight->center_px);
    if (!ray) continue;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray->direction * ray->direction.transpose();
    sum += across;
    rhs += across * ray->origin_mm;
    ++rays;
  }
  if (rays < 2 || sum.determinant() < 1e-4) return std::nullopt;
  Eigen::Vector3d point = sum.ldlt().solve(rhs);
  for (int round = 0; round < 5; ++round) {
    sum.setZero();
    rhs.setZero();
    for (const BarEndView* sight : sights) {
      const std::optional<Projection> seen = cameras[sight->camera].ProjectWithDerivative(point);
      if (!seen) return std::nullopt;
      sum += seen->d_pixel_d_world.transpose() * seen->d_pixel_d_world;
      rhs += seen->d_pixel_d_world.transpose() * (sight->center_px - seen->pixel_px);
    }
    point += sum.ldlt().solve(rhs);
  }
  return point;
}

}  // namespace

std::vector<ScaleBarFit> MeasureScaleBars(const CalibrationTarget& target, const CalibrationViews& views,
                                          const std::vector<CameraModel>& cameras) {
  std::map<std::tuple<int, int, int>, std::vector<const BarEndView*>> sights;  // (bar, frame, end)
  for (const BarEndView& view : views.bar_ends) sights[{view.bar, view.frame, view.end}].push_back(&view);
  std::vector<ScaleBarFit> out;
  for (size_t bar = 0; bar < target.scale_bars.size(); ++bar) {
    std::vector<double> lengths_mm;
    for (size_t frame = 0; frame < views.frames.size(); ++frame) {
      const int b = static_cast<int>(bar), f = static_cast<int>(frame);
      const auto first = sights.find({b, f, 0}), second = sights.find({b, f, 1});
      if (first == sights.end() || second == sights.end()) continue;
      const std::optional<Eigen::Vector3d> from = PointOf(first->second, cameras),
                                           to = PointOf(second->second, cameras);
      if (from && to) lengths_mm.push_back((*to - *from).norm());
    }
    if (lengths_mm.empty()) continue;
    ScaleBarFit fit;
    fit.bar = static_cast<int>(bar);
    fit.frames = static_cast<int>(lengths_mm.size());
    for (const double length : lengths_mm) fit.length_mm += length / fit.frames;
    double spread = 0;
    for (const double length : lengths_mm) spread += std::pow(length - fit.length_mm, 2);
    // A single frame tells nothing of its error; 0.1 % stands for it.
    fit.sigma_mm = fit.frames > 1 ? std::sqrt(spread / (fit.frames - 1) / fit.frames) : 1e-3 * fit.length_mm;
    out.push_back(fit);
  }
  return out;
}

absl::StatusOr<double> ScaleFromBars(const CalibrationTarget& target, const std::vector<ScaleBarFit>& bars) {
  double sum = 0, weights = 0;
  for (const ScaleBarFit& fit : bars) {
    const double relative_sigma = std::max(1e-6, fit.sigma_mm / fit.length_mm);
    const double weight = 1 / (relative_sigma * relative_sigma);
    sum += weight * target.scale_bars[fit.bar].length_mm / fit.length_mm;
    weights += weight;
  }
  if (!(weights > 0)) {
    return absl::FailedPreconditionError(
        "no scale bar was seen with both ends by two cameras in one frame; show the bar to more cameras, or "
        "take the scale from the boards' tags");
  }
  return sum / weights;
}

}  // namespace weft
