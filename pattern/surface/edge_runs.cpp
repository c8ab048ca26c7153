#include "pattern/surface/edge_runs.h"

#include <algorithm>
#include <utility>

namespace weft {

int RunAtEdge(const BoardState& state, int row, int col) {
  int shortest = kNoEdge;
  for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
    if (state.At(row + dr, col + dc) >= 0 || state.At(row - dr, col - dc) < 0) continue;
    int run = 1;
    for (const int side : {-1, 1}) {
      for (int k = 1; k < kLongestRun; ++k) {
        const int r = row + side * k * dc, c = col + side * k * dr;
        if (!state.board().Contains(r, c) || state.At(r, c) < 0) break;
        ++run;
      }
    }
    shortest = std::min({shortest, run, kLongestRun});
  }
  return shortest;
}

}  // namespace weft
