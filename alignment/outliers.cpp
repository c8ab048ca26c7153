#include "alignment/outliers.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/median.h"

namespace weft {
namespace {

// Distance of each target from the surface without the target. A vertex held by its edges with the weight
// k, and by the target with W, satisfies W (target - vertex) = k (vertex - position without the target).
std::vector<double> DistancesToOthers(const MeshGraph& graph, const std::vector<VertexTarget>& targets,
                                      const std::vector<Eigen::Vector3d>& position_mm,
                                      const AlignOptions& options) {
  std::vector<double> distance_mm;
  for (const VertexTarget& t : targets) {
    const double edges = options.elastic.lambda * options.elastic.distortion.stretch * graph.degree(t.vertex);
    Eigen::Vector3d way_mm = t.position_mm - position_mm[t.vertex];
    if (edges > 0) way_mm += WeightOf(t, options.detection) * way_mm / edges;
    distance_mm.push_back(way_mm.norm());
  }
  return distance_mm;
}

VertexTarget Weakened(VertexTarget target, double factor, const DetectionOptions& options) {
  if (target.sigma_mm == 0) target.sigma_mm = options.reference_sigma_mm;
  target.sigma_mm /= std::sqrt(factor);
  target.covariance_mm2 /= factor;
  target.fold_covariance_mm2 /= factor;
  return target;
}

bool IsOutlier(double ratio) { return ratio >= 1; }

}  // namespace

Eigen::Matrix3d WeightOf(const VertexTarget& target, const DetectionOptions& options) {
  Eigen::Matrix3d covariance = target.covariance_mm2;
  if (covariance.isZero()) covariance.diagonal().setConstant(target.sigma_mm * target.sigma_mm);
  if (!options.weigh_by_sigma || covariance.isZero()) return Eigen::Matrix3d::Identity();
  covariance -= target.fold_covariance_mm2;
  covariance.diagonal().array() +=
      options.min_sigma_mm * options.min_sigma_mm + options.cloth_sigma_mm * options.cloth_sigma_mm;
  return options.reference_sigma_mm * options.reference_sigma_mm * covariance.inverse();
}

std::vector<double> OutlierRatios(const MeshGraph& graph, const std::vector<VertexTarget>& targets,
                                  const std::vector<Eigen::Vector3d>& position_mm,
                                  const AlignOptions& options) {
  std::vector<double> ratios = DistancesToOthers(graph, targets, position_mm, options);
  const double limit_mm =
      std::max(options.robust.outlier_ratio * Median(ratios), options.robust.min_distance_mm);
  for (double& ratio : ratios) ratio = limit_mm > 0 ? ratio / limit_mm : 0;
  return ratios;
}

std::vector<VertexTarget> WithoutOutliers(const std::vector<VertexTarget>& targets,
                                          const std::vector<double>& ratios,
                                          const DetectionOptions& options) {
  constexpr double kUntouched = 0.5;  // of the limit; below, a weight would only blur good measurements
  std::vector<VertexTarget> kept;
  for (size_t i = 0; i < targets.size(); ++i) {
    if (IsOutlier(ratios[i])) continue;
    const double beyond = std::max(0.0, (ratios[i] - kUntouched) / (1 - kUntouched));
    const double biweight = std::pow(1 - beyond * beyond, 2);
    kept.push_back(beyond > 0 ? Weakened(targets[i], std::max(biweight, 1e-3), options) : targets[i]);
  }
  return kept;
}

bool AreAllBut(const std::vector<VertexTarget>& targets, const std::vector<double>& ratios,
               const std::vector<VertexTarget>& some) {
  size_t next = 0;
  for (size_t i = 0; i < targets.size(); ++i) {
    if (IsOutlier(ratios[i])) continue;
    if (next == some.size() || some[next++].vertex != targets[i].vertex) return false;
  }
  return next == some.size();
}

}  // namespace weft
