// Meshes from elsewhere that a registration starts from: of another moment, another program, or a job before.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "alignment/mesh.h"

namespace weft {

// Whether a mesh is one of the template, whose rest is `rest`. InvalidArgument says why not:
// - another number of vertices, or one that is not finite;
// - a face whose vertices the template does not join: they are in another order. Faces may be fewer, in any
// order,
//   and run either way;
// - edges that are in the median over 1.2 times as long as the template's, or as much shorter, with the unit
// where
//   one explains it;
// - a vertex that is far from all its neighbours, or 1 of 1,000 edges over five times as long.
absl::Status CheckStartMesh(const TriangleMesh& start, const TriangleMesh& rest);

// A start that lies as the targets do. `turned_deg` is 0 where it did: cloth moves, so that only a start
// which is turned by more than 30 degrees as a whole is moved. InvalidArgument for the mirror image of what
// the targets show.
struct PlacedStart {
  std::vector<Eigen::Vector3d> vertices_mm;
  double turned_deg = 0;
};
absl::StatusOr<PlacedStart> PlaceStart(std::vector<Eigen::Vector3d> start_mm,
                                       const std::vector<VertexTarget>& targets);

}  // namespace weft
