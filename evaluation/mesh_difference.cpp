#include "evaluation/mesh_difference.h"

#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

MeshDifference DifferenceOf(const std::vector<Eigen::Vector3d>& a_mm,
                            const std::vector<Eigen::Vector3d>& b_mm, const std::vector<double>& sigma_a_mm,
                            const std::vector<double>& sigma_b_mm) {
  MeshDifference out;
  out.distance_mm.reserve(a_mm.size());
  for (size_t v = 0; v < a_mm.size(); ++v) {
    const double distance_mm = (a_mm[v] - b_mm[v]).norm();
    out.distance_mm.push_back(std::isfinite(distance_mm) ? distance_mm : kNotKnown);
  }
  if (sigma_a_mm.empty() || sigma_b_mm.empty()) return out;
  out.distance_sigmas.reserve(a_mm.size());
  for (size_t v = 0; v < a_mm.size(); ++v) {
    const bool known = sigma_a_mm[v] > 0 && sigma_b_mm[v] > 0;
    out.distance_sigmas.push_back(known ? out.distance_mm[v] / std::hypot(sigma_a_mm[v], sigma_b_mm[v])
                                        : kNotKnown);
  }
  return out;
}

double ShareBeyondSigmas(const std::vector<double>& distance_sigmas) {
  double known = 0, beyond = 0;
  for (const double sigmas : distance_sigmas) {
    if (!std::isfinite(sigmas)) continue;
    ++known;
    beyond += sigmas > kDistanceSigmas99 ? 1 : 0;
  }
  return known > 0 ? beyond / known : kNotKnown;
}

}  // namespace weft
