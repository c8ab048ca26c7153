#include "evaluation/chamfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/counter_random.h"

namespace weft {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> RandomPoints(size_t count, uint64_t key) {
  std::vector<Vector3d> out(count);
  for (size_t k = 0; k < count; ++k)
    for (int axis = 0; axis < 3; ++axis)
      out[k][axis] = 100 * UniformOf(key, 3 * k + static_cast<size_t>(axis));
  return out;
}

TEST(Chamfer, FindsTheNearestPointsThatAllPairsFind) {
  const std::vector<Vector3d> a = RandomPoints(200, 1), b = RandomPoints(317, 2);
  const std::vector<double> found = NearestDistances(a, b);
  for (size_t k = 0; k < a.size(); ++k) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector3d& p : b) nearest = std::min(nearest, (a[k] - p).norm());
    EXPECT_DOUBLE_EQ(found[k], nearest);
  }
}

TEST(Chamfer, IsTheMeanOfBothWays) {
  EXPECT_DOUBLE_EQ(ChamferMm({{0, 0, 0}}, {{3, 0, 0}, {0, 5, 0}}), (3 + (3 + 5) / 2.0) / 2);
  // Points that change places are not apart.
  EXPECT_DOUBLE_EQ(ChamferMm({{0, 0, 0}, {9, 0, 0}}, {{9, 0, 0}, {0, 0, 0}}), 0);
}

}  // namespace
}  // namespace weft
