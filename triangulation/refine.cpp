#include "triangulation/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr int kMostReweightings = 100;

double Variance(const Sight& sight, const RefinementOptions& options) {
  const double sigma = std::max(sight.sigma_px, options.min_sigma_px);
  const double left = options.camera_sigma_px.empty() ? 0 : options.camera_sigma_px[sight.camera];
  return sigma * sigma + left * left + options.calibration_sigma_px * options.calibration_sigma_px;
}

// Gauss-Newton system of the reprojection error at a point.
struct NormalSystem {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double chi_square = 0;
  bool in_front = true;
};

NormalSystem Linearise(const Eigen::Vector3d& point, std::span<const Sight> sights,
                       std::span<const int> chosen, const RefinementOptions& options) {
  NormalSystem system;
  for (const int i : chosen) {
    const Sight& sight = sights[i];
    const Eigen::Vector3d offset = point - sight.origin_mm;
    const double depth = sight.axis.dot(offset);
    if (!(depth > 0)) {
      system.in_front = false;
      return system;
    }
    const Eigen::Vector2d residual = sight.pixel_from_offset * offset / depth;
    const Eigen::Matrix<double, 2, 3> jacobian =
        (sight.pixel_from_offset - residual * sight.axis.transpose()) / depth;
    const double variance = Variance(sight, options);
    const double sigmas = std::sqrt(residual.squaredNorm() / variance);
    const double weight = (sigmas > options.huber_sigmas ? options.huber_sigmas / sigmas : 1) / variance;
    system.matrix.noalias() += weight * jacobian.transpose() * jacobian;
    system.gradient.noalias() += weight * jacobian.transpose() * residual;
    system.chi_square += residual.squaredNorm() / variance;
  }
  return system;
}

}  // namespace

double ReprojectionCost(const Eigen::Vector3d& point_mm, std::span<const Sight> sights,
                        std::span<const int> chosen, const RefinementOptions& options) {
  double cost = 0;
  for (const int i : chosen) {
    if (!(sights[i].DepthMm(point_mm) > 0)) return std::numeric_limits<double>::infinity();
    const double squared = sights[i].ResidualPx(point_mm).squaredNorm() / Variance(sights[i], options);
    const double k = options.huber_sigmas;
    cost += squared <= k * k ? squared : 2 * k * std::sqrt(squared) - k * k;
  }
  return cost;
}

std::optional<RefinedPoint> RefinePoint(const Eigen::Vector3d& start_mm, std::span<const Sight> sights,
                                        std::span<const int> chosen, const RefinementOptions& options) {
  RefinedPoint out;
  out.position_mm = start_mm;
  for (out.iterations = 0; out.iterations < kMostReweightings;) {
    const NormalSystem system = Linearise(out.position_mm, sights, chosen, options);
    if (!system.in_front) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix3d> factor(system.matrix);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 1e-12)) return std::nullopt;
    const Eigen::Vector3d step = factor.solve(system.gradient);
    out.position_mm -= step;
    ++out.iterations;
    if (step.squaredNorm() < kRefinedMm * kRefinedMm) break;
  }
  const NormalSystem system = Linearise(out.position_mm, sights, chosen, options);
  if (!system.in_front || !out.position_mm.allFinite()) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix3d> factor(system.matrix);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 1e-12)) return std::nullopt;
  const Eigen::Matrix3d inverse = factor.solve(Eigen::Matrix3d::Identity());
  out.covariance_mm2 = 0.5 * (inverse + inverse.transpose());
  out.chi_square = system.chi_square;
  return out;
}

}  // namespace weft
