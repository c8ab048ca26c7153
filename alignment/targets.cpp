#include <algorithm>

#include "alignment/align.h"

namespace weft {

CloudTargets TargetsFromCloud(const Template& garment, const Cloud& cloud) {
  int rows = 0, cols = 0;
  for (const VertexNode& node : garment.node_of_vertex) {
    rows = std::max(rows, node.row + 1);
    cols = std::max(cols, node.col + 1);
  }
  const auto slot = [rows, cols](NodeKind kind, int row, int col) {
    return (static_cast<size_t>(kind) * rows + row) * cols + col;
  };
  std::vector<int> vertex_at(slot(NodeKind::kCorner, rows, 0), -1);
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const auto [row, col, kind] = garment.node_of_vertex[v];
    if (row < 0) continue;
    vertex_at[slot(kind, row, col)] = static_cast<int>(v);
  }

  const auto vertex_of = [&](const BoardNode& node) {
    const auto [row, col, kind] = node;
    const bool inside = row >= 0 && col >= 0 && row < rows && col < cols;
    return inside ? vertex_at[slot(kind, row, col)] : -1;
  };

  CloudTargets out;
  for (const CloudPoint& point : cloud.points) {
    const int vertex = vertex_of(point.node);
    if (vertex >= 0) {
      out.targets.push_back({vertex, point.position_mm, point.sigma_mm, point.views, point.covariance_mm2,
                             point.fold_covariance_mm2});
    } else if (point.node.kind == NodeKind::kCenter) {
      ++out.unclaimed;
    }
  }
  for (const CloudRay& ray : cloud.rays) {
    const int vertex = vertex_of(ray.node);
    if (vertex >= 0) out.rays.push_back({vertex, ray.origin_mm, ray.direction, ray.sigma_rad});
  }
  const auto by_vertex = [](const VertexTarget& a, const VertexTarget& b) { return a.vertex < b.vertex; };
  std::stable_sort(out.targets.begin(), out.targets.end(), by_vertex);
  // A cloud holds a node once; should one come from a file that does not, the first counts.
  const auto same = [](const VertexTarget& a, const VertexTarget& b) { return a.vertex == b.vertex; };
  out.targets.erase(std::unique(out.targets.begin(), out.targets.end(), same), out.targets.end());
  return out;
}

}  // namespace weft
