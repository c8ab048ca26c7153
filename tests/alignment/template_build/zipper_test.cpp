#include "alignment/template_build/zipper.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "alignment/template_build/mesh_topology.h"

namespace weft {
namespace {

// Two straight sides of a seam, `a` and `b` vertices over the same length.
struct Sides {
  Seam seam;
  std::vector<Eigen::Vector3d> position_mm;
};
Sides StraightSides(int a, int b) {
  Sides sides;
  for (int i = 0; i < a; ++i) {
    sides.seam.side_a.push_back(static_cast<int>(sides.position_mm.size()));
    sides.position_mm.emplace_back(0, 10.0 * i / (a - 1), 0);
  }
  for (int i = 0; i < b; ++i) {
    sides.seam.side_b.push_back(static_cast<int>(sides.position_mm.size()));
    sides.position_mm.emplace_back(1, 10.0 * i / (b - 1), 0);
  }
  return sides;
}

TEST(ZipSeam, UsesEveryEdgeOnceWhateverTheDensities) {
  for (const auto& [a, b] : {std::pair{11, 11}, {11, 5}, {3, 20}, {2, 2}, {1, 6}}) {
    if (a == 1) continue;  // a side has two vertices at least
    const Sides sides = StraightSides(a, b);
    const std::vector<Face> faces = ZipSeam(sides.seam, sides.position_mm);
    EXPECT_EQ(faces.size(), static_cast<size_t>(a + b - 2));
    const auto topology = CheckTopology(a + b, faces);
    ASSERT_TRUE(topology.ok()) << topology.status();
    ASSERT_EQ(topology->loops.size(), 1u);
    EXPECT_EQ(topology->loops[0].size(), static_cast<size_t>(a + b));
    // Side a lies on the left and its cloth to the left of it, so the strip shows its upper side.
    double area_mm2 = 0;
    for (const auto& [p, q, r] : faces) {
      const double twice_mm2 = (sides.position_mm[q] - sides.position_mm[p])
                                   .cross(sides.position_mm[r] - sides.position_mm[p])
                                   .z();
      EXPECT_GT(twice_mm2, 0);
      area_mm2 += twice_mm2 / 2;
    }
    EXPECT_NEAR(area_mm2, 10, 1e-9);
  }
}

TEST(FillHole, ClosesWithTheLeastArea) {
  // The border of a hole as the cloth around it runs: clockwise seen from the hole.
  std::vector<Eigen::Vector3d> position_mm;
  for (int i = 0; i < 12; ++i) position_mm.emplace_back(std::cos(i * M_PI / 6), -std::sin(i * M_PI / 6), 0);
  std::vector<int> loop(12);
  std::iota(loop.begin(), loop.end(), 0);
  const auto faces = FillHole(loop, position_mm, {});
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(faces->size(), 10u);
  double area_mm2 = 0;
  for (const auto& [p, q, r] : *faces) {
    area_mm2 += (position_mm[q] - position_mm[p]).cross(position_mm[r] - position_mm[p]).z() / 2;
  }
  EXPECT_NEAR(area_mm2, 3, 1e-9);  // a regular 12-gon
}

TEST(FillHole, DoublesNoEdge) {
  // A square hole one of whose diagonals is an edge of the cloth already.
  const std::vector<Eigen::Vector3d> position_mm = {{0, 0, 0}, {0, 1, 0}, {1, 1, 0.5}, {1, 0, 0}, {0, 0, 5}};
  const auto faces = FillHole({0, 1, 2, 3}, position_mm, {{0, 2, 4}});
  ASSERT_TRUE(faces.ok()) << faces.status();
  for (const Face& face : *faces)
    EXPECT_TRUE(std::count(face.begin(), face.end(), 1) == 1 && std::count(face.begin(), face.end(), 3) == 1);
  EXPECT_FALSE(FillHole({0, 1, 2, 3}, position_mm, {{0, 2, 4}, {1, 3, 4}}).ok());
}

}  // namespace
}  // namespace weft
