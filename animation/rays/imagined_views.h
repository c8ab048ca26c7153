// What cameras in other places would see of a known mesh: to learn how far few of them can be trusted.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "animation/rays/evidence.h"

namespace weft {

struct ImaginedViews {
  int cameras = 2;
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();  // the cameras stand around this axis
  double azimuth_deg = 0;                         // of the first; the others at equal angles
  double elevation_deg = 22;                      // they look from above and from below in turn
  double distance = 2.5;                          // of the garment's size, the diagonal of its box
  double most_facing_deg = 80;                    // flatter vertices are not seen
  double lost_share = 0.05;
  double noise_rad = 6e-5;    // of a ray's direction, per axis
  double sigma_rad = 1.2e-4;  // that the rays claim: the cloth's share is in it
  uint64_t seed = 1;
};

// Rays of the vertices that `is_node` names, ordered by vertex. Errors of RayScene.
absl::StatusOr<std::vector<VertexRay>> ImagineRays(const std::vector<Eigen::Vector3d>& vertices_mm,
                                                   const std::vector<Face>& faces,
                                                   const std::vector<bool>& is_node,
                                                   const ImaginedViews& views);

}  // namespace weft
