#include "alignment/cell_prediction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using testing::FlatSheet;
using ::testing::HasSubstr;
using testing::kCellMm;

constexpr int kPredictedRows = 12, kPredictedCols = 16;

// A sheet with a cell at each vertex, upright before a camera at the origin.
class PredictedSurfaceTest : public ::testing::Test {
 protected:
  PredictedSurfaceTest() {
    garment_.id = "sheet";
    garment_.rest = FlatSheet(kPredictedRows, kPredictedCols);
    for (Face& f : garment_.rest.faces) std::swap(f[1], f[2]);  // seen from the camera's side
    for (int v = 0; v < kPredictedRows * kPredictedCols; ++v)
      garment_.node_of_vertex.push_back({v / kPredictedCols + 3, v % kPredictedCols + 5});
    for (Eigen::Vector3d& v : garment_.rest.vertices_mm) v += Eigen::Vector3d(-20, -15, 600);
    camera_.id = "c";
    camera_.width_px = 640, camera_.height_px = 480;
    camera_.fx_px = camera_.fy_px = 1500;
    camera_.cx_px = 320, camera_.cy_px = 240;
  }

  RegisteredMesh Mesh(std::vector<Eigen::Vector3d> vertices_mm) const {
    RegisteredMesh mesh;
    mesh.sigma_mm.assign(vertices_mm.size(), 0.2f);
    mesh.state.assign(vertices_mm.size(), VertexState::kObserved);
    mesh.views.assign(vertices_mm.size(), 3);
    mesh.vertices_mm = std::move(vertices_mm);
    return mesh;
  }

  std::vector<CellInView> Look(const std::vector<Eigen::Vector3d>& vertices_mm) const {
    const auto neighborhoods = FindCellNeighborhoods(garment_);
    const auto surface = PredictedSurface::Build(garment_, neighborhoods, Mesh(vertices_mm), {});
    EXPECT_TRUE(surface.ok()) << surface.status();
    return surface->CellsIn(camera_);
  }

  Template garment_;
  CameraModel camera_;
};

TEST_F(PredictedSurfaceTest, PlacesCellsWhereTheCameraSeesThem) {
  const std::vector<CellInView> cells = Look(garment_.rest.vertices_mm);
  ASSERT_EQ(cells.size(), garment_.rest.vertices_mm.size());
  for (const CellInView& seen : cells) {
    const Eigen::Vector2d pixel = *camera_.Project(garment_.rest.vertices_mm[seen.vertex]);
    EXPECT_EQ(seen.cell.row, seen.vertex / kPredictedCols + 3);
    EXPECT_EQ(seen.cell.col, seen.vertex % kPredictedCols + 5);
    EXPECT_NEAR(seen.cell.pose.x, pixel.x(), 1e-3);
    EXPECT_NEAR(seen.cell.pose.y, pixel.y(), 1e-3);
    EXPECT_NEAR(seen.cell.pose.ax, kCellMm * 1500 / 600, 1e-3);
    EXPECT_NEAR(seen.cell.pose.by, kCellMm * 1500 / 600, 1e-3);
    EXPECT_NEAR(seen.cell.sigma_px, 0.2 * 1500 / 600, 1e-3);
  }
  EXPECT_THAT(cells[0].cell.in_sight, ElementsAre(0, 0, 0, 0, 1, 1, 0, 1, 1)) << "the upper left corner";
  EXPECT_THAT(cells[kPredictedCols + 1].cell.in_sight, ElementsAre(1, 1, 1, 1, 1, 1, 1, 1, 1));
}

TEST_F(PredictedSurfaceTest, SeesNoClothFromBehindAndNoneEdgeOn) {
  std::vector<Eigen::Vector3d> turned = garment_.rest.vertices_mm;
  for (Eigen::Vector3d& v : turned) v.x() = -v.x();
  EXPECT_TRUE(Look(turned).empty());
  for (size_t v = 0; v < turned.size(); ++v) {
    const Eigen::Vector3d& at = garment_.rest.vertices_mm[v];
    turned[v] = {0.05 * at.x(), at.y(), 600 + at.x()};
  }
  EXPECT_TRUE(Look(turned).empty());
}

TEST_F(PredictedSurfaceTest, ClothBeforeOthersHidesThem) {
  // The right half folds back over the left one, 5 mm before it and a little higher.
  std::vector<Eigen::Vector3d> folded = garment_.rest.vertices_mm;
  const double middle_mm = folded[kPredictedCols / 2].x();
  for (Eigen::Vector3d& v : folded) {
    if (v.x() > middle_mm) v = {2 * middle_mm - v.x(), v.y() + 1, v.z() - 5};
  }
  std::vector<bool> seen(folded.size(), false);
  for (const CellInView& cell : Look(folded)) {
    seen[cell.vertex] = true;
    EXPECT_LE(cell.vertex % kPredictedCols, kPredictedCols / 2) << "the flap shows its back";
  }
  // Of the left half, the column beyond the flap is in sight, those under its middle are not.
  EXPECT_TRUE(seen[6 * kPredictedCols]);
  EXPECT_FALSE(seen[6 * kPredictedCols + 4]);
  EXPECT_FALSE(seen[6 * kPredictedCols + 5]);
}

TEST_F(PredictedSurfaceTest, NeighborsAcrossASeamAreNone) {
  // Two panels that lie side by side on the board, but are no neighbours on the cloth.
  const TriangleMesh whole = garment_.rest;
  garment_.rest.faces.clear();
  for (const Face& f : whole.faces) {
    int left = 0;
    for (const int v : f) left += v % kPredictedCols < 8;
    if (left == 0 || left == 3) garment_.rest.faces.push_back(f);
  }
  const auto neighborhoods = FindCellNeighborhoods(garment_);
  EXPECT_THAT(neighborhoods[2 * kPredictedCols + 7],
              ElementsAre(1 * kPredictedCols + 6, 1 * kPredictedCols + 7, -1, 2 * kPredictedCols + 6,
                          2 * kPredictedCols + 7, -1, 3 * kPredictedCols + 6, 3 * kPredictedCols + 7, -1));
}

TEST_F(PredictedSurfaceTest, RefusesMeshesOfAnotherSize) {
  const auto neighborhoods = FindCellNeighborhoods(garment_);
  const auto surface = PredictedSurface::Build(garment_, neighborhoods, Mesh({}), {});
  EXPECT_THAT(std::string(surface.status().message()), HasSubstr("0 vertices"));
}

}  // namespace
}  // namespace weft
