#include "triangulation/cloud_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/median.h"

namespace weft {
namespace {

constexpr size_t kMostDistances = 1000;
constexpr size_t kLeastDistances = 50;

std::optional<double> MedianRatio(const Cloud& cloud, int rows, int cols, const CellDistance& pattern_mm) {
  const size_t step = std::max<size_t>(1, cloud.points.size() / kMostDistances);
  std::vector<double> ratios;
  for (size_t i = 0; i < cloud.points.size(); i += step) {
    const CloudPoint& point = cloud.points[i];
    if (point.node.kind != NodeKind::kCenter) continue;
    const auto at = [&](int steps) {
      return FindPoint(cloud,
                       {point.node.row + steps * rows, point.node.col + steps * cols, NodeKind::kCenter});
    };
    const CloudPoint *before = at(-1), *next = at(1), *after = at(2);
    if (before == nullptr || next == nullptr || after == nullptr) continue;
    const std::optional<double> known_mm = pattern_mm(point.node, next->node);
    const Eigen::Vector3d direction = (after->position_mm - before->position_mm).normalized();
    if (known_mm && *known_mm > 0)
      ratios.push_back((next->position_mm - point.position_mm).dot(direction) / *known_mm);
  }
  if (ratios.size() < kLeastDistances) return std::nullopt;
  return Median(std::move(ratios));
}

}  // namespace

std::optional<double> MeasureCloudScale(const Cloud& cloud, const CellDistance& pattern_mm) {
  const std::optional<double> along = MedianRatio(cloud, 0, 1, pattern_mm);
  const std::optional<double> down = MedianRatio(cloud, 1, 0, pattern_mm);
  if (!along || !down) return std::nullopt;
  return std::sqrt(*along * *down);
}

}  // namespace weft
