#include "alignment/untangle/face_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

namespace weft {
namespace {

using Pairs = std::vector<std::pair<int, int>>;

struct Triangles {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<Face> faces;
};

Triangles RandomTriangles(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place_mm(0, 100), way_mm(-5, 5);
  Triangles triangles;
  for (int f = 0; f < count; ++f) {
    const Eigen::Vector3d at(place_mm(random), place_mm(random), 0.2 * place_mm(random));
    for (int k = 0; k < 3; ++k)
      triangles.vertices_mm.push_back(at + Eigen::Vector3d(way_mm(random), way_mm(random), way_mm(random)));
    triangles.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return triangles;
}

Pairs PairsWithOverlap(const Triangles& triangles, float margin_mm) {
  const auto box_of = [&](int f) {
    FaceBox box{Eigen::Array3f::Constant(1e9f), Eigen::Array3f::Constant(-1e9f)};
    for (const int v : triangles.faces[f]) {
      box.low = box.low.min(triangles.vertices_mm[v].array().cast<float>());
      box.high = box.high.max(triangles.vertices_mm[v].array().cast<float>());
    }
    box.low -= margin_mm;
    box.high += margin_mm;
    return box;
  };
  Pairs pairs;
  for (int a = 0; a < static_cast<int>(triangles.faces.size()); ++a)
    for (int b = a + 1; b < static_cast<int>(triangles.faces.size()); ++b)
      if (box_of(a).Overlaps(box_of(b))) pairs.emplace_back(a, b);
  return pairs;
}

TEST(FaceGrid, VisitsEachPairWhoseBoxesOverlapOnce) {
  const Triangles triangles = RandomTriangles(400, 1);
  const FaceGrid grid(triangles.vertices_mm, triangles.faces, 0);
  Pairs visited;
  grid.VisitPairs(0, grid.cells(), [&](int a, int b) { visited.emplace_back(a, b); });
  std::sort(visited.begin(), visited.end());
  EXPECT_EQ(std::adjacent_find(visited.begin(), visited.end()), visited.end());
  const Pairs least = PairsWithOverlap(triangles, 0);
  const Pairs most = PairsWithOverlap(triangles, 1e-3f);  // boxes are wider by rounding
  EXPECT_TRUE(std::includes(visited.begin(), visited.end(), least.begin(), least.end()));
  EXPECT_TRUE(std::includes(most.begin(), most.end(), visited.begin(), visited.end()));
  EXPECT_GT(visited.size(), 200u);
}

TEST(FaceGrid, PairsOfSomeFacesComeInTheSameOrder) {
  const Triangles triangles = RandomTriangles(400, 2);
  const FaceGrid grid(triangles.vertices_mm, triangles.faces, 0.5);
  std::mt19937 random(3);
  for (const unsigned one_of : {1u, 2u, 10u, 1000u}) {
    std::vector<bool> some;
    for (size_t f = 0; f < triangles.faces.size(); ++f) some.push_back(random() % one_of == 0);
    Pairs expected, visited;
    grid.VisitPairs(0, grid.cells(), [&](int a, int b) {
      if (some[a] || some[b]) expected.emplace_back(a, b);
    });
    grid.VisitPairsOf(some, 0, grid.cells(), [&](int a, int b) { visited.emplace_back(a, b); });
    EXPECT_EQ(visited, expected) << "one of " << one_of;
  }
}

}  // namespace
}  // namespace weft
