#include "services/formats/files/ply_points.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace weft {
namespace {

void KeepRows(const std::vector<bool>& keep, PlyProperty& property) {
  const std::vector<double> values = std::exchange(property.values, {});
  const std::vector<size_t> starts = std::exchange(property.list_start, {});
  if (property.is_list) property.list_start.push_back(0);
  for (size_t row = 0; row < keep.size(); ++row) {
    if (!keep[row]) continue;
    const size_t begin = property.is_list ? starts[row] : row;
    const size_t end = property.is_list ? starts[row + 1] : row + 1;
    for (size_t i = begin; i < end; ++i) property.values.push_back(values[i]);
    if (property.is_list) property.list_start.push_back(property.values.size());
  }
}

}  // namespace

size_t DropUnmeasured(Ply& ply) {
  const auto vertex =
      std::ranges::find_if(ply.elements, [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertex == ply.elements.end()) return 0;
  std::vector<bool> keep(vertex->rows, true);
  for (const char* axis : {"x", "y", "z"}) {
    const PlyProperty* column = vertex->Find(axis);
    if (column == nullptr || column->is_list) continue;
    for (size_t row = 0; row < vertex->rows; ++row)
      keep[row] = keep[row] && std::isfinite(column->values[row]);
  }
  const auto dropped = static_cast<size_t>(std::ranges::count(keep, false));
  if (dropped == 0) return 0;
  for (PlyProperty& property : vertex->properties) KeepRows(keep, property);
  vertex->rows -= dropped;
  return dropped;
}

}  // namespace weft
