#include "simulation/cloth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace weft {
namespace {

ClothOptions SmallTube() {
  ClothOptions options;
  options.rows = 20, options.cols = 32, options.cell_mm = 4;
  return options;
}

TEST(Cloth, EveryCellHasOneVertex) {
  for (const ClothShape shape : {ClothShape::kSheet, ClothShape::kTube}) {
    ClothOptions options = SmallTube();
    options.shape = shape;
    const absl::StatusOr<Cloth> cloth = BuildCloth(options);
    ASSERT_TRUE(cloth.ok()) << cloth.status();
    std::set<std::pair<int, int>> cells;
    for (const VertexNode& cell : cloth->cell_of_vertex) {
      if (cell.row < 0) continue;
      EXPECT_TRUE(cells.insert({cell.row, cell.col}).second);
    }
    EXPECT_EQ(cells.size(), 20u * 32u);
    // Euler: a disk and an open tube.
    std::set<std::pair<int, int>> edges;
    for (const Face& f : cloth->rest.faces)
      for (int i = 0; i < 3; ++i) edges.insert(std::minmax(f[i], f[(i + 1) % 3]));
    const int euler = static_cast<int>(cloth->rest.vertices_mm.size()) - static_cast<int>(edges.size()) +
                      static_cast<int>(cloth->rest.faces.size());
    EXPECT_EQ(euler, shape == ClothShape::kSheet ? 1 : 0);
  }
}

TEST(Cloth, TubeHasThePrintedPitchAndFacesOutwards) {
  const Cloth cloth = *BuildCloth(SmallTube());
  const double radius = 32 * 4 / (2 * std::numbers::pi);
  for (const Eigen::Vector3d& p : cloth.rest.vertices_mm) EXPECT_NEAR(std::hypot(p.x(), p.z()), radius, 1e-9);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(cloth.rest.vertices_mm, cloth.rest.faces);
  for (size_t v = 0; v < normals.size(); ++v) {
    const Eigen::Vector3d& p = cloth.rest.vertices_mm[v];
    EXPECT_GT(normals[v].dot(Eigen::Vector3d(p.x(), 0, p.z()).normalized()), 0.95);
  }
}

TEST(Cloth, SizesOutOfRangeAreNamed) {
  ClothOptions options = SmallTube();
  options.cols = 5;
  EXPECT_NE(BuildCloth(options).status().message().find("cols"), std::string::npos);
}

}  // namespace
}  // namespace weft
