// Edges and neighbourhoods of a template's mesh at rest, built once per template.
#pragma once

#include <vector>

#include "alignment/mesh.h"

namespace weft {

struct MeshEdge {
  int a = 0, b = 0;  // a < b
};

// Neighbours of vertex v are entries [first[v], first[v + 1]), ordered by neighbour.
struct MeshGraph {
  int vertices = 0;
  std::vector<MeshEdge> edges;      // ordered by a, then b
  std::vector<int> first;           // [vertices + 1]
  std::vector<int> neighbor;        // [2 * edges]
  std::vector<float> cotan_weight;  // [2 * edges], half the sum of the cotangents of the angles opposite
  std::vector<int> component;       // [vertices], numbered from 0 in the order of their first vertex
  int components = 0;

  int degree(int v) const { return first[v + 1] - first[v]; }
};

// Cotangent weights (Meyer et al. 2003) of the mesh at rest. Negative ones (obtuse triangles) and those of
// degenerate triangles are raised to a hundredth of the median, so that fills stay within their border.
MeshGraph BuildMeshGraph(const TriangleMesh& mesh);

// Mean length of the edges at rest; 0 without edges.
double MeanEdgeMm(const TriangleMesh& mesh, const MeshGraph& graph);

// Number of edges from the nearest vertex for which `is_source` holds, [vertices]; -1 where there is none in
// the component.
std::vector<int> RingDistance(const MeshGraph& graph, const std::vector<bool>& is_source);

}  // namespace weft
