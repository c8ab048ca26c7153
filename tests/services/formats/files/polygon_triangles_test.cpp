#include "services/formats/files/polygon_triangles.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

namespace weft {
namespace {

using Corners = std::vector<Eigen::Vector3d>;

// Of triangles that are turned like the polygon; what is turned against it counts as negative.
double AreaOf(const Corners& corners, const std::vector<std::array<int, 3>>& triangles) {
  double area = 0;
  for (const auto& [a, b, c] : triangles)
    area += (corners[b] - corners[a]).cross(corners[c] - corners[a]).z() / 2;
  return area;
}

TEST(TrianglesOfPolygon, SplitsAQuadAlongItsShorterDiagonal) {
  const Corners wide = {{0, 0, 0}, {2, -1, 0}, {4, 0, 0}, {2, 1, 0}};
  for (const auto& triangle : TrianglesOfPolygon(wide)) {
    const std::set<int> of(triangle.begin(), triangle.end());
    EXPECT_TRUE(of.contains(1) && of.contains(3));
  }
  EXPECT_NEAR(AreaOf(wide, TrianglesOfPolygon(wide)), 4, 1e-12);
}

TEST(TrianglesOfPolygon, AConcaveQuadIsSplitInside) {
  // An arrow: the shorter diagonal, from 1 to 3, lies outside.
  const Corners arrow = {{0, 0, 0}, {1, -0.2, 0}, {0.2, 0, 0}, {1, 0.2, 0}};
  const auto triangles = TrianglesOfPolygon(arrow);
  ASSERT_EQ(triangles.size(), 2u);
  for (const auto& triangle : triangles) EXPECT_GT(AreaOf(arrow, {triangle}), 0);
}

TEST(TrianglesOfPolygon, CoversAPolygonWithNotches) {
  // A comb of four teeth.
  Corners comb = {{0, 0, 0}, {8, 0, 0}};
  for (int tooth = 3; tooth >= 0; --tooth) {
    comb.emplace_back(2 * tooth + 2, 3, 0);
    comb.emplace_back(2 * tooth + 1, 3, 0);
    if (tooth > 0) comb.emplace_back(2 * tooth + 0.9, 1, 0);
  }
  const auto triangles = TrianglesOfPolygon(comb);
  EXPECT_EQ(triangles.size(), comb.size() - 2);
  double whole = 0;
  for (size_t i = 0; i < comb.size(); ++i) whole += comb[i].cross(comb[(i + 1) % comb.size()]).z() / 2;
  EXPECT_NEAR(AreaOf(comb, triangles), whole, 1e-9);
  for (const auto& triangle : triangles) EXPECT_GT(AreaOf(comb, {triangle}), 0);
}

TEST(TrianglesOfPolygon, SplitsWhatHasNoArea) {
  EXPECT_EQ(TrianglesOfPolygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}}).size(), 3u);
  EXPECT_EQ(TrianglesOfPolygon(Corners(6, {1, 1, 1})).size(), 4u);
}

}  // namespace
}  // namespace weft
