#include "simulation/printed_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace weft {
namespace {

// Centres of the cells (0, 0), (0, 1) and (1, 0), 10 mm apart, and a cell that is far off.
const std::vector<Face> kPrintedFaces = {{0, 1, 2}, {1, 3, 2}};
const std::vector<VertexNode> kPrintedNodes = {{0, 0}, {0, 1}, {1, 0}, {1, 5}};

TEST(PrintedMesh, HasNoPrintWhereNodesAreNoNeighbours) {
  const ClothPrint print = PrintFromVertexNodes(kPrintedFaces, kPrintedNodes);
  ASSERT_EQ(print.of_face.size(), 2u);
  EXPECT_TRUE(print.of_face[0][1] == BoardPoint(1.5, 0.5));
  EXPECT_TRUE(print.of_face[0][2] == BoardPoint(0.5, 1.5));
  EXPECT_TRUE(std::isnan(print.of_face[1][0].x()));
}

TEST(PrintedMesh, FindsTheSurfaceUnderAPlaceOfTheBoard) {
  const PrintLocator locator(PrintFromVertexNodes(kPrintedFaces, kPrintedNodes));
  const auto found = locator.Find({0.75, 0.75});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->face, 0);
  EXPECT_LT((found->weights - Eigen::Vector3d(0.5, 0.25, 0.25)).norm(), 1e-12);
  const std::vector<Eigen::Vector3d> vertices_mm = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {0, 0, 0}};
  EXPECT_LT((PositionOf(*found, vertices_mm, kPrintedFaces) - Eigen::Vector3d(2.5, 2.5, 0)).norm(), 1e-12);
  // Beyond the triangle, and beyond the print.
  EXPECT_FALSE(locator.Find({1.4, 1.4}));
  EXPECT_FALSE(locator.Find({5.5, 1.5}));
  EXPECT_LT((locator.Beyond(0, {2.5, 0.5}).weights - Eigen::Vector3d(-1, 2, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace weft
