// How fast a registered mesh slides over the true surface.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/mesh.h"
#include "alignment/mesh_graph.h"

namespace weft {

// A material point is identified by its position on the cloth at rest. Each registered vertex lies near a
// material point of the true surface. Without drift this point is constant, however the cloth moves. Its
// offset from the vertex's own material point is the tangential error. It is pulled back to the cloth at
// rest through the true deformation of the neighbourhood, so that rotation and stretch of the cloth do not
// count.
class TrueDrift {
 public:
  explicit TrueDrift(const TriangleMesh& rest);

  // Tangential error of each vertex, [vertices], in mm of the cloth at rest along two axes fixed to the
  // cloth; NaN where the neighbourhood spans no plane. Vertices whose true position is NaN have no offset and
  // are no neighbours. Sizes must match the rest.
  std::vector<Eigen::Vector2d> MaterialOffsets(const std::vector<Eigen::Vector3d>& registered_mm,
                                               const std::vector<Eigen::Vector3d>& true_mm) const;

 private:
  MeshGraph graph_;
  std::vector<Eigen::Vector2d> rest_edge_mm_;  // [2 * edges], neighbours of each vertex in its rest plane
};

// Length of the change of the offsets from one frame to the next in mm per frame, [vertices].
std::vector<double> DriftBetween(const std::vector<Eigen::Vector2d>& offsets_mm,
                                 const std::vector<Eigen::Vector2d>& next_offsets_mm);

}  // namespace weft
