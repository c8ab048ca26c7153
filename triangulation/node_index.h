// Observations of a frame set grouped by node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "triangulation/triangulate.h"

namespace weft {

struct SeenNode {
  BoardNode node;
  size_t first = 0, last = 0;  // range in NodeIndex::entries
};

struct NodeIndex {
  struct Entry {
    int view = 0;         // index into the views
    int observation = 0;  // index into the view's observations
  };
  std::vector<SeenNode> nodes;  // ordered by kind, row, column
  std::vector<Entry> entries;   // ordered by node, then camera, then place in the view
};

// Rows and columns must lie in 0 to 4096.
NodeIndex GroupByNode(const std::vector<ViewObservations>& views);

}  // namespace weft
