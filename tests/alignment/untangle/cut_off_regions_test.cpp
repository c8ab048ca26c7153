#include "alignment/untangle/cut_off_regions.h"

#include <gtest/gtest.h>

#include <numeric>

#include "alignment/untangle/self_intersection.h"
#include "alignment/untangle/untangle_push.h"
#include "tests/alignment/untangle/intersecting_sheets.h"

namespace weft {
namespace {

using testing::DentedLayers;
using testing::FlatSheet;
using testing::PinchedFold;
using testing::WholeMesh;

bool AllTrue(const std::vector<bool>& values) {
  return std::find(values.begin(), values.end(), false) == values.end();
}

TEST(UntanglePatch, ReachesSomeRingsAndJoinsGroupsThatMeet) {
  const TriangleMesh mesh = FlatSheet(30, 30);
  const FacesOfVertex around(900, mesh.faces);
  const auto at = [](int row, int col) { return row * 30 + col; };
  const auto grown = GrowGroups(mesh.faces, around, {{at(5, 5)}, {at(5, 9)}, {at(25, 25)}}, 2);
  ASSERT_EQ(grown.size(), 2u);
  EXPECT_TRUE(std::binary_search(grown[0].begin(), grown[0].end(), at(5, 7)));
  EXPECT_TRUE(std::binary_search(grown[0].begin(), grown[0].end(), at(5, 11)));
  EXPECT_FALSE(std::binary_search(grown[0].begin(), grown[0].end(), at(5, 12)));
  EXPECT_TRUE(std::binary_search(grown[1].begin(), grown[1].end(), at(23, 25)));
}

TEST(UntanglePatch, KeepsClothNearbyAsFixed) {
  const TriangleMesh mesh = DentedLayers(30, 1, 10);  // the other layer lies within 3 mm everywhere
  const UntanglePatch patch =
      CutPatch(mesh.vertices_mm, mesh.vertices_mm, mesh.faces, {}, {}, {434, 435, 436}, 4);
  EXPECT_EQ(patch.free, 3);
  EXPECT_TRUE(std::any_of(patch.vertex.begin() + 3, patch.vertex.end(), [](int v) { return v >= 900; }));
  for (size_t v = 0; v < patch.vertex.size(); ++v) {
    EXPECT_EQ(patch.position_mm[v], mesh.vertices_mm[patch.vertex[v]]);
    EXPECT_LT((patch.position_mm[v] - mesh.vertices_mm[435]).norm(), 20);
  }
  for (int v = 0; v < 3; ++v) EXPECT_EQ(patch.NeighborsOf(v).size(), patch.FacesOf(v).size());
}

TEST(UntanglePatch, HoldsKnownVerticesMoreFirmly) {
  const TriangleMesh mesh = FlatSheet(3, 3);
  const std::vector<float> sigma_mm = {1, 1, 1, 1, 1, 1, 1, 1, 0.5f};
  const UntanglePatch patch =
      CutPatch(mesh.vertices_mm, mesh.vertices_mm, mesh.faces, sigma_mm, {}, {0, 1, 2, 3, 4, 5, 6, 7, 8}, 4);
  EXPECT_NEAR(patch.weight[8] / patch.weight[0], 4, 1e-9);
  EXPECT_NEAR(std::accumulate(patch.weight.begin(), patch.weight.end(), 0.0), 9, 1e-9);
}

TEST(CutOffRegions, AreTheTwoDentsOfTwoLayers) {
  const TriangleMesh mesh = DentedLayers(40, 4, 12);
  const UntanglePatch patch = WholeMesh(mesh);
  const std::vector<Piercing> piercings = FindPiercings(patch);
  ASSERT_FALSE(piercings.empty());
  const CutOffRegions found = FindRegions(patch, piercings);
  EXPECT_TRUE(AllTrue(found.explained));
  ASSERT_EQ(found.regions.size(), 2u);
  for (const CutOffRegion& region : found.regions) EXPECT_FALSE(region.loop);
  // The upper layer's region is what lies below the lower one.
  std::vector<int> below;
  for (int v = 1600; v < 3200; ++v) {
    if (mesh.vertices_mm[v].z() < 0) below.push_back(v);
  }
  EXPECT_EQ(found.regions[1].vertices, below);
}

TEST(CutOffRegions, AreLoopsWhereAFoldHasTurnedInsideOut) {
  const UntanglePatch patch = WholeMesh(PinchedFold(50, 1));
  const CutOffRegions found = FindRegions(patch, FindPiercings(patch));
  EXPECT_TRUE(AllTrue(found.explained));
  ASSERT_FALSE(found.regions.empty());
  for (const CutOffRegion& region : found.regions) EXPECT_TRUE(region.loop);
}

TEST(CutOffRegions, PiercingsAreThoseOfTheFacesThatIntersect) {
  const TriangleMesh mesh = testing::RoughLayers(20, 2, 3);
  const UntanglePatch patch = WholeMesh(mesh);
  std::vector<FacePair> pairs;
  for (const Piercing& piercing : FindPiercings(patch)) {
    for (const int f : patch.edges[piercing.edge].face) {
      if (f >= 0) pairs.push_back({std::min(f, piercing.face), std::max(f, piercing.face)});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const IntersectingPairs found = FindIntersectingPairs(mesh.vertices_mm, mesh.faces);
  std::vector<FacePair> expected = found.apart;
  expected.insert(expected.end(), found.at_vertex.begin(), found.at_vertex.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(pairs, expected);
}

TEST(Flatten, LeavesNoSheetToNothing) {
  UntanglePatch patch = WholeMesh(testing::Tube(12, 6, 8));
  std::vector<int> all(patch.free);
  std::iota(all.begin(), all.end(), 0);
  Flatten(all, 0, &patch);
  EXPECT_EQ(patch.position_mm, patch.observed_mm);
}

TEST(Flatten, LaysABumpBetweenItsSurroundings) {
  TriangleMesh mesh = FlatSheet(21, 21);
  mesh.vertices_mm[220].z() = 9;
  UntanglePatch patch = WholeMesh(mesh);
  Flatten({220}, 2, &patch);
  for (const Eigen::Vector3d& p : patch.position_mm) EXPECT_NEAR(p.z(), 0, 1e-9);
}

}  // namespace
}  // namespace weft
