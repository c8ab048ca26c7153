#include "alignment/return_to_points.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "alignment/vertex_sigma.h"

namespace weft {
namespace {

// Squared length of `way_mm` in standard deviations of the target's noise; what folds cause is no noise.
double SquaredSigmas(const VertexTarget& target, const Eigen::Vector3d& way_mm,
                     const DetectionOptions& options) {
  Eigen::Matrix3d noise_mm2 = target.covariance_mm2;
  if (noise_mm2.isZero()) noise_mm2.diagonal().setConstant(target.sigma_mm * target.sigma_mm);
  noise_mm2 -= target.fold_covariance_mm2;
  noise_mm2.diagonal().array() += options.min_sigma_mm * options.min_sigma_mm;
  return way_mm.dot(noise_mm2.inverse() * way_mm);
}

// What E_Dist takes out of noise alone, hardly ever more.
double NoiseSquaredSigmas(const VertexTarget& target, const AlignOptions& options) {
  const DetectionOptions& detection = options.detection;
  const double noise_mm2 =
      std::max(0.0, target.sigma_mm * target.sigma_mm - target.fold_covariance_mm2.trace() / 3);
  const double held_mm2 =
      noise_mm2 + std::pow(detection.min_sigma_mm, 2) + std::pow(detection.cloth_sigma_mm, 2);
  const double weight = detection.weigh_by_sigma ? std::pow(detection.reference_sigma_mm, 2) / held_mm2 : 1;
  const double stretch = options.elastic.lambda * options.elastic.distortion.stretch;
  return 3 * kExpectedPull * (1 - SmoothedVarianceShare(stretch / weight));
}

}  // namespace

void ReturnToPoints(const std::vector<VertexTarget>& targets, const AlignOptions& options,
                    std::vector<Eigen::Vector3d>* position_mm) {
  const double limit = options.noise_sigmas * options.noise_sigmas;
  if (limit == 0) return;
  for (const VertexTarget& t : targets) {
    if (t.sigma_mm == 0 && t.covariance_mm2.isZero()) continue;
    Eigen::Vector3d& vertex_mm = (*position_mm)[t.vertex];
    const Eigen::Vector3d way_mm = vertex_mm - t.position_mm;
    const double sigmas =
        std::max(0.0, SquaredSigmas(t, way_mm, options.detection) - NoiseSquaredSigmas(t, options));
    vertex_mm = t.position_mm + limit / (limit + sigmas) * way_mm;
  }
}

}  // namespace weft
