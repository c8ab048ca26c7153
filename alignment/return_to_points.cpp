#include "alignment/return_to_points.h"

#include <algorithm>

#include "alignment/point_noise.h"

namespace weft {
namespace {

// In expected squared offsets by noise; 1 % of a vertex's offsets by noise alone are greater.
constexpr double kMostNoise = 3.6;

}  // namespace

void ReturnToPoints(const std::vector<VertexTarget>& targets, const AlignOptions& options,
                    std::vector<Eigen::Vector3d>* position_mm) {
  const double limit = options.noise_sigmas * options.noise_sigmas;
  if (limit == 0) return;
  for (const VertexTarget& t : targets) {
    if (!HasKnownNoise(t)) continue;
    Eigen::Vector3d& vertex_mm = (*position_mm)[t.vertex];
    const Eigen::Vector3d way_mm = vertex_mm - t.position_mm;
    const double noise = 3 * kMostNoise * OffsetVarianceShare(t, options);
    const double sigmas = std::max(0.0, way_mm.dot(NoiseInformation(t, options.detection) * way_mm) - noise);
    vertex_mm = t.position_mm + limit / (limit + sigmas) * way_mm;
  }
}

}  // namespace weft
