#include "simulation/cloth.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "simulation/cloth_motion.h"

namespace weft {
namespace {

ClothOptions SmallTube() {
  ClothOptions options;
  options.rows = 20, options.cols = 32, options.cell_mm = 4;
  return options;
}

MotionOptions ShortMotion() {
  MotionOptions options;
  options.frames = 4, options.settle_s = 0.4, options.step_s = 1.0 / 10000;
  return options;
}

TEST(Cloth, EveryCellHasOneVertex) {
  for (const ClothShape shape : {ClothShape::kSheet, ClothShape::kTube}) {
    ClothOptions options = SmallTube();
    options.shape = shape;
    const absl::StatusOr<Cloth> cloth = BuildCloth(options);
    ASSERT_TRUE(cloth.ok()) << cloth.status();
    std::set<std::pair<int, int>> cells;
    for (const VertexCell& cell : cloth->cell_of_vertex) {
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

// Relative change of the lengths of all grid edges, ascending.
std::vector<double> Strains(const Cloth& cloth, const std::vector<Eigen::Vector3d>& x) {
  std::vector<double> out;
  const auto add = [&](int a, int b) {
    const double rest = (cloth.rest.vertices_mm[a] - cloth.rest.vertices_mm[b]).norm();
    out.push_back(std::abs((x[a] - x[b]).norm() / rest - 1));
  };
  for (int i = 0; i < cloth.grid_rows; ++i)
    for (int j = 0; j < cloth.grid_cols; ++j) {
      if (j + 1 < cloth.grid_cols) add(cloth.vertex_at(i, j), cloth.vertex_at(i, j + 1));
      if (i + 1 < cloth.grid_rows) add(cloth.vertex_at(i, j), cloth.vertex_at(i + 1, j));
    }
  std::sort(out.begin(), out.end());
  return out;
}

bool SegmentHitsTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double from = normal.dot(p - a), to = normal.dot(q - a);
  if (from * to >= 0) return false;
  const Eigen::Vector3d at = p + from / (from - to) * (q - p);
  return normal.dot((b - a).cross(at - a)) > 0 && normal.dot((c - b).cross(at - b)) > 0 &&
         normal.dot((a - c).cross(at - c)) > 0;
}

// Pairs of an edge and a face that it passes through; every edge against every face.
int EdgesThroughFaces(const std::vector<Face>& faces, const std::vector<Eigen::Vector3d>& x) {
  std::set<std::pair<int, int>> edges;
  for (const Face& f : faces)
    for (int i = 0; i < 3; ++i) edges.insert(std::minmax(f[i], f[(i + 1) % 3]));
  int through = 0;
  for (const auto& [a, b] : edges)
    for (const Face& f : faces) {
      if (f[0] == a || f[1] == a || f[2] == a || f[0] == b || f[1] == b || f[2] == b) continue;
      through += SegmentHitsTriangle(x[a], x[b], x[f[0]], x[f[1]], x[f[2]]) ? 1 : 0;
    }
  return through;
}

TEST(ClothMotion, ClothFoldsButDoesNotStretch) {
  for (const ClothShape shape : {ClothShape::kSheet, ClothShape::kTube}) {
    ClothOptions options = SmallTube();
    options.shape = shape;
    const Cloth cloth = *BuildCloth(options);
    const auto frames = SimulateMotion(cloth, ShortMotion());
    ASSERT_TRUE(frames.ok()) << frames.status();
    ASSERT_EQ(frames->size(), 4u);
    for (const auto& x : *frames) {
      for (const Eigen::Vector3d& p : x) ASSERT_TRUE(p.allFinite());
      const std::vector<double> strains = Strains(cloth, x);
      EXPECT_LT(strains[strains.size() / 2], 0.01);
      EXPECT_LT(strains.back(), 0.08);
      EXPECT_EQ(EdgesThroughFaces(cloth.rest.faces, x), 0);
    }
    double moved = 0, folded = 0;
    for (size_t v = 0; v < cloth.rest.vertices_mm.size(); ++v) {
      moved = std::max(moved, ((*frames)[3][v] - (*frames)[0][v]).norm());
      folded = std::max(folded, ((*frames)[0][v] - cloth.rest.vertices_mm[v]).norm());
    }
    EXPECT_GT(moved, 1) << "the cloth stands still";
    EXPECT_GT(folded, 2) << "the cloth has no folds";
  }
}

TEST(ClothMotion, FollowsFromTheSeed) {
  const Cloth cloth = *BuildCloth(SmallTube());
  MotionOptions options = ShortMotion();
  options.frames = 2;
  const auto first = SimulateMotion(cloth, options), again = SimulateMotion(cloth, options);
  options.seed = 2;
  const auto other = SimulateMotion(cloth, options);
  ASSERT_TRUE(first.ok() && again.ok() && other.ok());
  EXPECT_EQ(*first, *again);
  EXPECT_NE(*first, *other);
}

TEST(ClothMotion, MoreFramesBeginWithTheSameOnes) {
  const Cloth cloth = *BuildCloth(SmallTube());
  MotionOptions options = ShortMotion();
  options.frames = 1;
  const auto one = SimulateMotion(cloth, options);
  options.frames = 3;
  const auto three = SimulateMotion(cloth, options);
  ASSERT_TRUE(one.ok() && three.ok());
  EXPECT_EQ((*one)[0], (*three)[0]);
}

TEST(ClothMotion, OptionsOutOfRangeAreNamed) {
  MotionOptions options = ShortMotion();
  options.step_s = 1;
  const auto frames = SimulateMotion(*BuildCloth(SmallTube()), options);
  EXPECT_EQ(frames.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(frames.status().message().find("step_s"), std::string::npos);
}

}  // namespace
}  // namespace weft
