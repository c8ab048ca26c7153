#include "services/studio/preview/coverage.h"

namespace weft {

size_t CoverageClass(int views) {
  if (views < 3) return static_cast<size_t>(views);
  return views < 6 ? 3 : 4;
}

Coverage::Coverage(int rows, int cols, const std::vector<std::pair<int, int>>& garment_cells)
    : rows_(rows), cols_(cols), views_(Index(rows, 0), garment_cells.empty() ? 0 : -1) {
  for (const auto& [row, col] : garment_cells)
    if (row >= 0 && row < rows && col >= 0 && col < cols) views_[Index(row, col)] = 0;
}

void Coverage::Set(const std::string& camera, const std::vector<Observation>& observations) {
  std::vector<size_t>& cells = cells_[camera];
  for (const size_t cell : cells) --views_[cell];
  cells.clear();
  for (const Observation& observation : observations) {
    const auto& [row, col, kind] = observation.node;
    if (kind != NodeKind::kCenter || views_[Index(row, col)] < 0) continue;
    cells.push_back(Index(row, col));
    ++views_[cells.back()];
  }
}

std::array<int64_t, kCoverageClasses> Coverage::Count() const {
  std::array<int64_t, kCoverageClasses> count{};
  for (const int views : views_)
    if (views >= 0) ++count[CoverageClass(views)];
  return count;
}

int64_t Coverage::CellsOf(const std::string& camera) const {
  const auto cells = cells_.find(camera);
  return cells == cells_.end() ? -1 : static_cast<int64_t>(cells->second.size());
}

}  // namespace weft
