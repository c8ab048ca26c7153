#include "alignment/sliced_mesh.h"

#include <algorithm>

namespace weft {

SlicedMesh SliceMesh(const TriangleMesh& rest, const MeshGraph& graph) {
  SlicedMesh mesh;
  mesh.vertices = graph.vertices;
  mesh.slices = (graph.vertices + kSliceLanes - 1) / kSliceLanes;
  mesh.first_slot.assign(1, 0);
  mesh.degree.assign(static_cast<size_t>(mesh.slices) * kSliceLanes, 0);
  for (int s = 0; s < mesh.slices; ++s) {
    const int begin = s * kSliceLanes, end = std::min(begin + kSliceLanes, graph.vertices);
    int slots = 0;
    for (int v = begin; v < end; ++v) slots = std::max(slots, graph.degree(v));
    for (int j = 0; j < slots; ++j) {
      for (int v = begin; v < begin + kSliceLanes; ++v) {
        const bool exists = v < end && j < graph.degree(v);
        const int other = exists ? graph.neighbor[graph.first[v] + j] : v;
        Eigen::Vector3d e = Eigen::Vector3d::Zero();
        if (exists) e = rest.vertices_mm[other] - rest.vertices_mm[v];
        mesh.neighbor.push_back(other);
        mesh.rest_x.push_back(static_cast<float>(e.x()));
        mesh.rest_y.push_back(static_cast<float>(e.y()));
        mesh.rest_z.push_back(static_cast<float>(e.z()));
      }
    }
    for (int v = begin; v < end; ++v) mesh.degree[v] = static_cast<float>(graph.degree(v));
    mesh.first_slot.push_back(mesh.first_slot.back() + slots);
  }
  return mesh;
}

}  // namespace weft
