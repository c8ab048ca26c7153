#include "triangulation/node_index.h"

#include <algorithm>
#include <numeric>

namespace weft {

NodeIndex GroupByNode(const std::vector<ViewObservations>& views) {
  int rows = 0, cols = 0;
  size_t total = 0;
  for (const ViewObservations& view : views) {
    total += view.observations.size();
    for (const Observation& o : view.observations) {
      rows = std::max(rows, o.node.row + 1);
      cols = std::max(cols, o.node.col + 1);
    }
  }
  const auto slot = [&](const BoardNode& node) {
    return (static_cast<size_t>(node.kind) * rows + node.row) * cols + node.col;
  };

  // Counting sort: views in the order of their cameras, so entries of a node come out ordered by camera.
  std::vector<int> order(views.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return views[a].camera < views[b].camera; });
  std::vector<uint32_t> start(2 * static_cast<size_t>(rows) * cols + 1, 0);
  for (const ViewObservations& view : views) {
    for (const Observation& o : view.observations) ++start[slot(o.node) + 1];
  }
  NodeIndex index;
  for (size_t s = 0; s + 1 < start.size(); ++s) {
    if (start[s + 1] > 0) {
      const int row = static_cast<int>(s / cols % rows), col = static_cast<int>(s % cols);
      const NodeKind kind = s / cols / rows == 0 ? NodeKind::kCenter : NodeKind::kCorner;
      index.nodes.push_back({{row, col, kind}, start[s], start[s] + start[s + 1]});
    }
    start[s + 1] += start[s];
  }
  index.entries.resize(total);
  for (const int v : order) {
    const std::vector<Observation>& observations = views[v].observations;
    for (size_t i = 0; i < observations.size(); ++i) {
      index.entries[start[slot(observations[i].node)]++] = {v, static_cast<int>(i)};
    }
  }
  return index;
}

}  // namespace weft
