#include "services/results/export/split_vertices.h"

#include <map>
#include <numeric>
#include <tuple>

namespace weft {

SplitMesh SplitAtSeams(size_t vertices, const std::vector<Face>& faces, const MeshTexture& texture) {
  SplitMesh split;
  split.origin.resize(vertices);
  std::iota(split.origin.begin(), split.origin.end(), 0);
  split.faces = faces;
  split.uv = texture.of_vertex;
  if (texture.of_corner.empty()) return split;
  std::vector<bool> has_place(vertices);
  std::map<std::tuple<int, float, float>, int> copies;
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int vertex = faces[f][k];
      const Eigen::Vector2f& uv = texture.of_corner[f][k];
      if (!has_place[vertex]) split.uv[vertex] = uv;
      has_place[vertex] = true;
      if (uv == split.uv[vertex]) continue;
      const auto [copy, is_new] =
          copies.try_emplace({vertex, uv.x(), uv.y()}, static_cast<int>(split.origin.size()));
      if (is_new) {
        split.origin.push_back(vertex);
        split.uv.push_back(uv);
      }
      split.faces[f][k] = copy->second;
    }
  }
  return split;
}

}  // namespace weft
