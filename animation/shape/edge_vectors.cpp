#include "animation/shape/edge_vectors.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace weft {
namespace {

std::vector<double> WaysFrom(int start, const TriangleMesh& rest, const MeshGraph& graph) {
  std::vector<double> way(graph.vertices, std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  way[start] = 0;
  open.emplace(0, start);
  while (!open.empty()) {
    const auto [length, v] = open.top();
    open.pop();
    if (length > way[v]) continue;
    for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
      const int other = graph.neighbor[i];
      const double next = length + (rest.vertices_mm[v] - rest.vertices_mm[other]).norm();
      if (next >= way[other]) continue;
      way[other] = next;
      open.emplace(next, other);
    }
  }
  return way;
}

}  // namespace

FarPoints ChooseFarPoints(int count, const TriangleMesh& rest, const MeshGraph& graph) {
  FarPoints out;
  std::vector<double> nearest(graph.vertices, std::numeric_limits<double>::infinity());
  int next = 0;
  while (static_cast<int>(out.vertices.size()) < std::min(count, graph.vertices)) {
    out.vertices.push_back(next);
    out.ways_mm.push_back(WaysFrom(next, rest, graph));
    for (int v = 0; v < graph.vertices; ++v) nearest[v] = std::min(nearest[v], out.ways_mm.back()[v]);
    next = static_cast<int>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  for (const double way : nearest)
    if (std::isfinite(way)) out.furthest_mm = std::max(out.furthest_mm, way);
  return out;
}

}  // namespace weft
