#include "alignment/point_noise.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "alignment/vertex_sigma.h"

namespace weft {

bool HasKnownNoise(const VertexTarget& target) {
  return target.sigma_mm != 0 || !target.covariance_mm2.isZero();
}

Eigen::Matrix3d NoiseInformation(const VertexTarget& target, const DetectionOptions& options) {
  Eigen::Matrix3d noise_mm2 = target.covariance_mm2;
  if (noise_mm2.isZero()) noise_mm2.diagonal().setConstant(target.sigma_mm * target.sigma_mm);
  noise_mm2 -= target.fold_covariance_mm2;
  noise_mm2.diagonal().array() += options.min_sigma_mm * options.min_sigma_mm;
  return noise_mm2.inverse();
}

// Noise along an eigenvector of the graph's Laplacian, of eigenvalue e, leaves the offset c e / (1 + c e) of
// it, for the coupling c. This is the mean of the squares over the eigenvalues of SmoothedVarianceShare.
double OffsetVarianceShare(const VertexTarget& target, const AlignOptions& options) {
  const DetectionOptions& detection = options.detection;
  const double noise_mm2 =
      std::max(0.0, target.sigma_mm * target.sigma_mm - target.fold_covariance_mm2.trace() / 3);
  const double held_mm2 =
      noise_mm2 + std::pow(detection.min_sigma_mm, 2) + std::pow(detection.cloth_sigma_mm, 2);
  const double weight = detection.weigh_by_sigma ? std::pow(detection.reference_sigma_mm, 2) / held_mm2 : 1;
  const double coupling = options.elastic.lambda * options.elastic.distortion.stretch / weight;
  return std::max(0.0, 1 - 2 * SmoothedVarianceShare(coupling) + 1 / (1 + kMostEigenvalue * coupling));
}

}  // namespace weft
