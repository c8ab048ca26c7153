#include "alignment/untangle/guarded_return.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "alignment/untangle/cut_off_regions.h"
#include "alignment/untangle/self_intersection.h"
#include "tests/alignment/untangle/intersecting_sheets.h"

namespace weft {
namespace {

using testing::WholeMesh;

TEST(ReturnGuarded, ReturnsAllTheWayWhereNothingIsInTheWay) {
  UntanglePatch patch = WholeMesh(testing::FlatSheet(12, 12));
  for (Eigen::Vector3d& p : patch.position_mm) p.z() += 1.5 * std::sin(p.x() / 5);
  for (int run = 0; run < 6; ++run) ReturnGuarded({}, &patch);  // each ends where little is left to gain
  EXPECT_LT(testing::MaxDistance(patch.position_mm, patch.observed_mm), 0.02);
}

// Two layers whose observed places lie on the wrong sides of each other: they come to rest on one another.
TEST(ReturnGuarded, StopsAtTheOtherLayer) {
  const TriangleMesh mesh = testing::DentedLayers(40, 4, 14);
  UntanglePatch patch = WholeMesh(mesh);
  for (size_t v = 1600; v < 3200; ++v) patch.position_mm[v].z() = 1.5;  // the upper layer without its dent
  ASSERT_TRUE(FindPiercings(patch).empty());
  const std::vector<Eigen::Vector3d> start = patch.position_mm;
  const ReturnOptions options;
  EXPECT_GT(ReturnGuarded(options, &patch), 1);
  EXPECT_TRUE(FindIntersectingPairs(patch.position_mm, patch.faces).empty());
  double before = 0, after = 0, lowest = 10;
  for (int v = 1600; v < patch.free; ++v) {
    before += (start[v] - patch.observed_mm[v]).squaredNorm();
    after += (patch.position_mm[v] - patch.observed_mm[v]).squaredNorm();
    lowest = std::min(lowest, patch.position_mm[v].z());
  }
  EXPECT_LT(after, 0.7 * before);
  EXPECT_GT(lowest, 0.04);
  EXPECT_LT(lowest, 0.07);
}

TEST(ReturnGuarded, PartsLayersThatAreTooNear) {
  TriangleMesh above = testing::FlatSheet(10, 10);
  for (Eigen::Vector3d& v : above.vertices_mm) v += Eigen::Vector3d(1.1, 0.7, 0.01);
  UntanglePatch patch = WholeMesh(testing::Joined(testing::FlatSheet(10, 10), above));
  ReturnGuarded({}, &patch);
  double gap_mm = 10;
  for (int v = 0; v < 100; ++v) {
    gap_mm = std::min(gap_mm, patch.position_mm[v + 100].z() - patch.position_mm[v].z());
  }
  EXPECT_GT(gap_mm, 0.04);
}

// A small measured sheet above a large one, which has its place 2 mm below that.
UntanglePatch SheetAboveItsPlace(bool large_is_measured) {
  TriangleMesh small = testing::FlatSheet(8, 8);
  for (Eigen::Vector3d& v : small.vertices_mm) v += Eigen::Vector3d(40.3, 40.7, -2);
  const TriangleMesh mesh = testing::Joined(testing::FlatSheet(36, 36), small);
  std::vector<double> bound_mm(mesh.vertices_mm.size(), 0.3);
  if (!large_is_measured) {
    std::fill_n(bound_mm.begin(), 36 * 36, std::numeric_limits<double>::infinity());
  }
  std::vector<int> all(mesh.vertices_mm.size());
  std::iota(all.begin(), all.end(), 0);
  UntanglePatch patch = CutPatch(mesh.vertices_mm, mesh.vertices_mm, mesh.faces, {}, bound_mm, all, 8);
  for (size_t v = 36 * 36; v < all.size(); ++v) {
    patch.position_mm[v].z() = 1;
    patch.released[v] = true;
  }
  return patch;
}

double FarthestOfSmallSheetMm(const UntanglePatch& patch) {
  double far_mm = 0;
  for (int v = 36 * 36; v < patch.free; ++v)
    far_mm = std::max(far_mm, (patch.position_mm[v] - patch.observed_mm[v]).norm());
  return far_mm;
}

TEST(ReturnGuarded, MeasuredClothPushesHiddenClothAway) {
  UntanglePatch patch = SheetAboveItsPlace(false);
  ReturnGuarded({}, &patch);
  EXPECT_LT(FarthestOfSmallSheetMm(patch), 0.1);
  EXPECT_TRUE(FindIntersectingPairs(patch.position_mm, patch.faces).empty());
  EXPECT_LT(patch.position_mm[18 * 36 + 18].z(), -2);
  EXPECT_LT(patch.position_mm[0].norm(), 0.1);  // far from there nothing moves
}

TEST(ReturnGuarded, MeasuredClothDoesNotPushMeasuredCloth) {
  UntanglePatch patch = SheetAboveItsPlace(true);
  ReturnGuarded({}, &patch);
  EXPECT_GT(FarthestOfSmallSheetMm(patch), 1.6);
  for (int v = 0; v < 36 * 36; ++v)
    EXPECT_LE((patch.position_mm[v] - patch.observed_mm[v]).norm(), 0.3 + 1e-9);
  EXPECT_TRUE(FindIntersectingPairs(patch.position_mm, patch.faces).empty());
}

}  // namespace
}  // namespace weft
