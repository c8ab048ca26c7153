// Whether a mesh is a clean surface, and what its borders are.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

struct MeshTopology {
  int edges = 0;
  int components = 0;  // vertices without faces do not count
  int euler = 0;       // vertices - edges + faces
  int genus = 0;       // handles, of all components together
  // Closed runs of edges with one face, as that face runs through them: the surface lies to the left when
  // seen from outside. Each starts at its lowest vertex; ordered by it.
  std::vector<std::vector<int>> loops;
};

// FailedPrecondition names the first edge or vertex at which the faces are no oriented manifold: an edge
// with three faces or two of the same orientation, a vertex with several fans. Faces must have valid and
// distinct indices.
absl::StatusOr<MeshTopology> CheckTopology(int vertices, const std::vector<Face>& faces);

// Length of a closed run of vertices.
double LoopLengthMm(const std::vector<int>& loop, const std::vector<Eigen::Vector3d>& vertices_mm);

}  // namespace weft
