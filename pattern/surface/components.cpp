#include "pattern/surface/components.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace weft {
namespace {

// Size of the 4-connected component of each cell.
std::vector<int> ComponentSizes(const BoardState& state) {
  const auto& cells = state.cells();
  std::vector<int> size(cells.size(), 0);
  std::vector<int> members;
  for (size_t seed = 0; seed < cells.size(); ++seed) {
    if (size[seed] > 0) continue;
    members.assign(1, static_cast<int>(seed));
    size[seed] = 1;
    for (size_t k = 0; k < members.size(); ++k) {
      const ViewCell& cell = cells[members[k]];
      for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
        const int next = state.At(cell.row + dr, cell.col + dc);
        if (next < 0 || size[next] > 0) continue;
        size[next] = 1;
        members.push_back(next);
      }
    }
    for (const int k : members) size[k] = static_cast<int>(members.size());
  }
  return size;
}

// Chance finds as many more small components as there is more to search, and each further cell of one is less
// likely by about the same factor.
int LeastComponent(int least_of_few, size_t searched) {
  constexpr float kCellsOfFew = 1000, kCellsPerE = 4.4f;
  const float more = kCellsPerE * std::log(std::max(1.0f, static_cast<float>(searched) / kCellsOfFew));
  return least_of_few + static_cast<int>(more);
}

}  // namespace

void DropSmallComponents(int least_of_few, size_t searched, BoardState* state) {
  const std::vector<int> sizes = ComponentSizes(*state);
  const int least = LeastComponent(least_of_few, searched);
  state->Filter([&](size_t k) { return sizes[k] >= least; });
}

int LargestComponent(const BoardState& state) {
  const std::vector<int> sizes = ComponentSizes(state);
  return sizes.empty() ? 0 : *std::max_element(sizes.begin(), sizes.end());
}

}  // namespace weft
