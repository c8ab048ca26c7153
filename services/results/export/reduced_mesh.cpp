#include "services/results/export/reduced_mesh.h"

#include <algorithm>
#include <utility>

#include "alignment/decimation/decimated_mesh.h"
#include "base/status_macros.h"
#include "services/results/export/split_vertices.h"

namespace weft {
absl::StatusOr<ReducedMesh> ReduceMesh(const TriangleMesh& mesh, const MeshTexture& texture,
                                       size_t max_vertices) {
  SplitMesh split = SplitAtSeams(mesh.vertices_mm.size(), mesh.faces, texture);
  TriangleMesh cut;
  for (const int vertex : split.origin) cut.vertices_mm.push_back(mesh.vertices_mm[vertex]);
  cut.faces = std::move(split.faces);
  WEFT_ASSIGN_OR_RETURN(const DecimatedMesh fewer, DecimateMesh(cut, max_vertices, split.uv));
  ReducedMesh reduced;
  for (const int vertex : fewer.vertices) reduced.vertices.push_back(split.origin[vertex]);
  std::ranges::sort(reduced.vertices);
  reduced.vertices.erase(std::unique(reduced.vertices.begin(), reduced.vertices.end()),
                         reduced.vertices.end());
  std::vector<int> place(mesh.vertices_mm.size(), -1);
  for (size_t k = 0; k < reduced.vertices.size(); ++k) place[reduced.vertices[k]] = static_cast<int>(k);
  if (!texture.empty())
    for (const int vertex : reduced.vertices) reduced.texture.of_vertex.push_back(texture.of_vertex[vertex]);
  for (const Face& face : fewer.faces) {
    Face& added = reduced.faces.emplace_back();
    std::array<Eigen::Vector2f, 3> corners;
    for (size_t k = 0; k < face.size(); ++k) {
      const int cut_vertex = fewer.vertices[face[k]];
      added[k] = place[split.origin[cut_vertex]];
      if (!texture.empty()) corners[k] = split.uv[cut_vertex];
    }
    if (!texture.of_corner.empty()) reduced.texture.of_corner.push_back(corners);
  }
  return reduced;
}

}  // namespace weft
