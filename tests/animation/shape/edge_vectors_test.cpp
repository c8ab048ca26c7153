#include "animation/shape/edge_vectors.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

// A strip of squares of 10 mm, and a triangle by itself.
TriangleMesh StripAndTriangle(int squares) {
  TriangleMesh out;
  for (int i = 0; i <= squares; ++i)
    for (int side = 0; side < 2; ++side) out.vertices_mm.emplace_back(10 * i, 10 * side, 0);
  for (int i = 0; i < squares; ++i) {
    const int a = 2 * i;
    out.faces.push_back({a, a + 2, a + 1});
    out.faces.push_back({a + 1, a + 2, a + 3});
  }
  const auto apart = static_cast<int>(out.vertices_mm.size());
  for (int i = 0; i < 3; ++i) out.vertices_mm.emplace_back(i == 1 ? 10 : 0, i == 2 ? 10 : 0, 500);
  out.faces.push_back({apart, apart + 1, apart + 2});
  return out;
}

TEST(EdgeVectors, AreThoseAlongTheEdges) {
  const TriangleMesh mesh = StripAndTriangle(6);
  const FarPoints far = ChooseFarPoints(1, mesh, BuildMeshGraph(mesh));
  ASSERT_EQ(far.vertices, (std::vector<int>{0}));
  for (int i = 0; i <= 6; ++i) {
    EXPECT_DOUBLE_EQ(far.ways_mm[0][2 * i], 10 * i);
    // Diagonals go down to the right: the other side is reached around a corner.
    EXPECT_DOUBLE_EQ(far.ways_mm[0][2 * i + 1], 10 * i + 10);
  }
  EXPECT_TRUE(std::isinf(far.ways_mm[0].back()));
  EXPECT_DOUBLE_EQ(far.furthest_mm, 70);
}

TEST(EdgeVectors, PointsAreSpreadOverAllParts) {
  const TriangleMesh mesh = StripAndTriangle(6);
  const MeshGraph graph = BuildMeshGraph(mesh);
  const FarPoints far = ChooseFarPoints(3, mesh, graph);
  // Another part is infinitely far, then the strip's other end.
  EXPECT_EQ(far.vertices, (std::vector<int>{0, 14, 13}));
  EXPECT_EQ(ChooseFarPoints(100, mesh, graph).vertices.size(), 17u);
  EXPECT_DOUBLE_EQ(ChooseFarPoints(100, mesh, graph).furthest_mm, 0);
}

}  // namespace
}  // namespace weft
