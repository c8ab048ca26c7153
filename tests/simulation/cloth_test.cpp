#include "simulation/cloth.h"
#include "alignment/vertex_normals.h"

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

TEST(Cloth, SlitsDivideColumnsAndKeepTheWholePrint) {
  ClothOptions options = SmallTube();
  options.shape = ClothShape::kSheet;
  options.slits = {9, 20}, options.slits_from = 5;
  const Cloth cloth = *BuildCloth(options);
  ASSERT_EQ(cloth.slit_edges.size(), 2u);
  double printed = 0;
  std::set<std::pair<int, int>> edges;
  for (size_t f = 0; f < cloth.rest.faces.size(); ++f) {
    const auto& [a, b, c] = cloth.print.of_face[f];
    const double twice = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
    EXPECT_LT(twice, 0) << "face " << f << " turns the other way";
    printed -= twice / 2;
    for (int i = 0; i < 3; ++i)
      edges.insert(std::minmax(cloth.rest.faces[f][i], cloth.rest.faces[f][(i + 1) % 3]));
    // No face reaches across a slit.
    const int mid_col = static_cast<int>((a + b + c).x() / 3);
    if ((a + b + c).y() / 3 < 5.5 || (mid_col != 8 && mid_col != 9)) continue;
    for (const BoardPoint& p : {a, b, c})
      EXPECT_TRUE(mid_col == 8 ? p.x() <= 9 : p.x() >= 9) << p.transpose();
  }
  EXPECT_NEAR(printed, 20 * 32, 1e-9);
  const int euler = static_cast<int>(cloth.rest.vertices_mm.size()) - static_cast<int>(edges.size()) +
                    static_cast<int>(cloth.rest.faces.size());
  EXPECT_EQ(euler, 1);
}

TEST(Cloth, SlitsOutOfPlaceAreNamed) {
  ClothOptions options = SmallTube();
  options.slits = {9};
  EXPECT_NE(BuildCloth(options).status().message().find("slit is at 9"), std::string::npos);
  options.shape = ClothShape::kSheet, options.slits_from = 19;
  EXPECT_NE(BuildCloth(options).status().message().find("slits_from is 19"), std::string::npos);
}

TEST(Cloth, SizesOutOfRangeAreNamed) {
  ClothOptions options = SmallTube();
  options.cols = 5;
  EXPECT_NE(BuildCloth(options).status().message().find("cols"), std::string::npos);
}

}  // namespace
}  // namespace weft
