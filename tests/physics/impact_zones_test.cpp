#include "physics/impact_zones.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "base/counter_random.h"

namespace weft {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> RandomPoints(int count, double size, uint64_t key) {
  std::vector<Vector3d> out;
  for (int k = 0; k < count; ++k)
    out.push_back(size * Vector3d(NormalOf(key, 3 * k), NormalOf(key, 3 * k + 1), NormalOf(key, 3 * k + 2)));
  return out;
}

// Against sets of vertices that are joined one after another.
TEST(ImpactZones, UniteWhatTheyHaveInCommon) {
  constexpr int kVertices = 60;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    ImpactZones zones(kVertices);
    std::vector<std::set<int>> sets;
    for (uint64_t k = 0; k < 14; ++k) {
      std::array<int, 4> united;
      for (uint64_t i = 0; i < 4; ++i)
        united[i] = static_cast<int>(kVertices * UniformOf(KeyOf(seed, "vertices"), 4 * k + i));
      zones.Unite(united);
      std::set<int> joined(united.begin(), united.end());
      std::vector<std::set<int>> others;
      for (const std::set<int>& one : sets) {
        const bool meets = std::any_of(united.begin(), united.end(), [&](int v) { return one.contains(v); });
        if (meets) {
          joined.insert(one.begin(), one.end());
        } else {
          others.push_back(one);
        }
      }
      others.push_back(joined);
      sets = others;
    }
    for (int v = 0; v < kVertices; ++v)
      for (int w = 0; w < kVertices; ++w) {
        bool together = false, any = false;
        for (const std::set<int>& one : sets) {
          together |= one.contains(v) && one.contains(w);
          any |= one.contains(v);
        }
        EXPECT_EQ(zones.Unites({v, w, v, w}), together) << v << " " << w;
        EXPECT_EQ(zones.Contains(v), any) << v;
      }
  }
}

TEST(ImpactZones, MoveAsTheNearestRigidMotion) {
  const std::vector<Vector3d> from = RandomPoints(12, 20, 1);
  const Eigen::Isometry3d turn =
      Eigen::Translation3d(0.4, -0.2, 0.7) * Eigen::AngleAxisd(0.02, Vector3d(1, 2, -1).normalized());
  std::vector<Vector3d> wanted;
  for (const Vector3d& p : from) wanted.push_back(turn * p - p);
  ImpactZones zones(from.size());
  zones.Unite({0, 1, 2, 3});
  zones.Unite({3, 4, 5, 6});
  zones.Unite({8, 9, 10, 11});
  // A motion that is rigid already stays, and vertices of no zone are left alone.
  std::vector<Vector3d> moved(from.size(), Vector3d::Constant(9));
  zones.MoveAsOne(from, wanted, 100, moved);
  for (size_t v = 0; v < from.size(); ++v)
    EXPECT_LT((moved[v] - (v == 7 ? Vector3d::Constant(9) : wanted[v])).norm(), 1e-9) << v;
  // Any other becomes one, and each zone has its own.
  const std::vector<Vector3d> noise = RandomPoints(12, 0.3, 2);
  for (size_t v = 0; v < from.size(); ++v) wanted[v] += noise[v];
  zones.MoveAsOne(from, wanted, 100, moved);
  for (const std::pair<int, int>& zone : {std::pair(0, 7), std::pair(8, 12)})
    for (int v = zone.first; v < zone.second; ++v)
      for (int w = zone.first; w < v; ++w)
        EXPECT_NEAR((from[v] + moved[v] - from[w] - moved[w]).norm(), (from[v] - from[w]).norm(), 1e-9);
  // No vertex goes farther than it may: the mean of all does not.
  zones.MoveAsOne(from, wanted, 0.1, moved);
  Vector3d mean = Vector3d::Zero();
  for (int v = 0; v < 7; ++v) mean += wanted[v] / 7;
  for (int v = 0; v < 7; ++v) EXPECT_LT((moved[v] - mean).norm(), 1e-9);
}

}  // namespace
}  // namespace weft
