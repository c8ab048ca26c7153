#include <algorithm>

#include "alignment/align.h"

namespace weft {

CloudTargets TargetsFromCloud(const Template& garment, const Cloud& cloud) {
  int cols = 0;
  for (const VertexCell& cell : garment.cell_of_vertex) cols = std::max(cols, cell.col + 1);
  const auto slot = [cols](int row, int col) { return static_cast<size_t>(row) * cols + col; };
  std::vector<int> vertex_at;
  for (size_t v = 0; v < garment.cell_of_vertex.size(); ++v) {
    const auto [row, col] = garment.cell_of_vertex[v];
    if (row < 0) continue;
    if (slot(row, col) >= vertex_at.size()) vertex_at.resize(slot(row + 1, 0), -1);
    vertex_at[slot(row, col)] = static_cast<int>(v);
  }

  CloudTargets out;
  for (const CloudPoint& point : cloud.points) {
    const auto [row, col, kind] = point.node;
    if (kind != NodeKind::kCenter) continue;
    const bool inside = row >= 0 && col >= 0 && col < cols && slot(row, col) < vertex_at.size();
    const int vertex = inside ? vertex_at[slot(row, col)] : -1;
    if (vertex < 0) {
      ++out.unclaimed;
    } else {
      out.targets.push_back({vertex, point.position_mm, point.sigma_mm, point.views, point.covariance_mm2,
                             point.fold_covariance_mm2});
    }
  }
  const auto by_vertex = [](const VertexTarget& a, const VertexTarget& b) { return a.vertex < b.vertex; };
  std::stable_sort(out.targets.begin(), out.targets.end(), by_vertex);
  // A cloud holds a node once; should one come from a file that does not, the first counts.
  const auto same = [](const VertexTarget& a, const VertexTarget& b) { return a.vertex == b.vertex; };
  out.targets.erase(std::unique(out.targets.begin(), out.targets.end(), same), out.targets.end());
  return out;
}

}  // namespace weft
