// Ways along the edges of a mesh, and vertices that lie far from each other by them.
#pragma once

#include <vector>

#include "alignment/mesh.h"
#include "alignment/mesh_graph.h"

namespace weft {

struct FarPoints {
  std::vector<int> vertices;
  std::vector<std::vector<double>> ways_mm;  // of each of them to all vertices; infinite in other components
  double furthest_mm = 0;                    // the longest finite way from a vertex to the nearest of them
};

// Vertex 0, then each time the vertex that is furthest from those before; `count` of them, fewer on meshes of
// fewer vertices.
FarPoints ChooseFarPoints(int count, const TriangleMesh& rest, const MeshGraph& graph);

}  // namespace weft
