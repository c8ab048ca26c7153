#include "alignment/ray_targets.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "base/median.h"

namespace weft {
namespace {

// Against a point of the same sigma: the vertices around have no points either. The presets choose between 1,
// 4 and 16 (docs/decoding-accuracy-history.md).
constexpr double kGain = 4;

// Per mm^2 across the ray.
double WeightOf(const RayTarget& ray, const Eigen::Vector3d& at_mm, const RayFit& fit) {
  const double sigma_mm = ray.sigma_rad * (at_mm - ray.origin_mm).norm();
  return kGain * std::pow(fit.reference_sigma_mm, 2) / (std::pow(sigma_mm, 2) + std::pow(fit.floor_mm, 2));
}

}  // namespace

absl::Status CheckRays(const std::vector<RayTarget>& rays, int vertices) {
  constexpr double kRoundingOfLength = 1e-5;
  for (size_t i = 0; i < rays.size(); ++i) {
    const RayTarget& ray = rays[i];
    const auto bad = [&](const std::string& why) {
      return absl::InvalidArgumentError(absl::StrCat("ray ", i, " (vertex ", ray.vertex, "): ", why));
    };
    if (ray.vertex < 0 || ray.vertex >= vertices)
      return bad(absl::StrCat("the template has ", vertices, " vertices, numbered from 0"));
    if (!ray.origin_mm.allFinite()) return bad("origin_mm is not finite");
    if (!(std::abs(ray.direction.norm() - 1) < kRoundingOfLength)) return bad("direction must have length 1");
    if (!(ray.sigma_rad >= 0) || !std::isfinite(ray.sigma_rad))
      return bad("sigma_rad must be a number from 0");
  }
  return absl::OkStatus();
}

std::vector<RayTarget> RaysInReach(const std::vector<RayTarget>& rays, const std::vector<bool>& measured,
                                   const std::vector<Eigen::Vector3d>& position_mm, const RayFit& fit) {
  std::vector<RayTarget> near;
  std::copy_if(rays.begin(), rays.end(), std::back_inserter(near), [&](const RayTarget& ray) {
    return !measured[ray.vertex] && ray.WayMm(position_mm[ray.vertex]).norm() < fit.reach_mm;
  });
  return near;
}

// A vertex held by its edges with the weight k, and across a ray with w, satisfies w (ray - vertex) = k
// (vertex - position without the ray).
std::vector<RayTarget> WithoutOutliers(const std::vector<RayTarget>& rays, const MeshGraph& graph,
                                       const std::vector<Eigen::Vector3d>& position_mm, const RayFit& fit) {
  std::vector<double> distance_mm;
  for (const RayTarget& ray : rays) {
    const Eigen::Vector3d& at_mm = position_mm[ray.vertex];
    const double edges = fit.edge_weight * graph.degree(ray.vertex);
    const double pulled = edges > 0 ? 1 + WeightOf(ray, at_mm, fit) / edges : 1;
    distance_mm.push_back(pulled * ray.WayMm(at_mm).norm());
  }
  if (rays.empty()) return {};
  const double limit_mm = std::max(fit.outlier_ratio * Median(distance_mm), fit.least_outlier_mm);
  std::vector<RayTarget> kept;
  for (size_t i = 0; i < rays.size(); ++i)
    if (distance_mm[i] < limit_mm) kept.push_back(rays[i]);
  return kept;
}

void AddRays(const std::vector<RayTarget>& rays, const std::vector<Eigen::Vector3d>& position_mm,
             const RayFit& fit, ElasticProblem* problem) {
  for (const RayTarget& ray : rays) {
    const Eigen::Vector3d& at_mm = position_mm[ray.vertex];
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    problem->Add(ray.vertex, at_mm + ray.WayMm(at_mm), WeightOf(ray, at_mm, fit) * across);
  }
}

}  // namespace weft
