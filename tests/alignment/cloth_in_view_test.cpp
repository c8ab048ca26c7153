#include "alignment/cloth_in_view.h"

#include <gtest/gtest.h>

#include <utility>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;

constexpr int kViewedRows = 20, kViewedCols = 30;

// A sheet with a cell at each vertex, 600 mm before a camera at the origin that looks along z.
class ClothInViewTest : public ::testing::Test {
 protected:
  ClothInViewTest() {
    garment_.rest = FlatSheet(kViewedRows, kViewedCols);
    for (Face& f : garment_.rest.faces) std::swap(f[1], f[2]);  // seen from the camera's side
    for (int v = 0; v < kViewedRows * kViewedCols; ++v)
      garment_.node_of_vertex.push_back({v / kViewedCols, v % kViewedCols});
    mesh_.vertices_mm = garment_.rest.vertices_mm;
    for (Eigen::Vector3d& v : mesh_.vertices_mm) v += Eigen::Vector3d(-40, -25, 600);
    mesh_.state.assign(mesh_.vertices_mm.size(), VertexState::kObserved);
    CameraModel camera;
    camera.width_px = 640, camera.height_px = 480;
    camera.fx_px = camera.fy_px = 1500;
    camera.cx_px = 320, camera.cy_px = 240;
    rig_.cameras.push_back(camera);
  }

  // What the camera sees of the mesh, `off_px` aside.
  std::vector<ViewObservations> Seen(double off_px) const {
    std::vector<ViewObservations> views(1);
    for (size_t v = 0; v < mesh_.vertices_mm.size(); ++v) {
      const VertexNode& node = garment_.node_of_vertex[v];
      const Eigen::Vector2d pixel = *rig_.cameras[0].Project(mesh_.vertices_mm[v]);
      views[0].observations.push_back({pixel.x() + off_px, pixel.y(), {node.row, node.col, node.kind}});
    }
    return views;
  }

  ClothInView Count(const std::vector<ViewObservations>& views) const {
    const std::vector<ClothInView> counts = CountClothInView(rig_, views, garment_, mesh_);
    EXPECT_EQ(counts.size(), views.size());
    return counts.empty() ? ClothInView() : counts[0];
  }

  Template garment_;
  RegisteredMesh mesh_;
  Rig rig_;
};

TEST_F(ClothInViewTest, WhatFacesTheCameraIsExpectedAndFoundWhereItIs) {
  EXPECT_EQ(Count(Seen(0)).vertices, kViewedRows * kViewedCols);
  EXPECT_EQ(Count(Seen(0)).seen, kViewedRows * kViewedCols);
  EXPECT_EQ(Count(Seen(15)).seen, kViewedRows * kViewedCols);
  EXPECT_EQ(Count(Seen(25)).seen, 0);
  EXPECT_EQ(Count(Seen(25)).vertices, kViewedRows * kViewedCols);
  std::vector<ViewObservations> none(1);
  EXPECT_EQ(Count(none).vertices, kViewedRows * kViewedCols);
  EXPECT_EQ(Count(none).seen, 0);
}

TEST_F(ClothInViewTest, WhatNoCameraCouldSeeIsNotExpected) {
  const std::vector<ViewObservations> views = Seen(0);
  // The back of the cloth.
  for (Face& f : garment_.rest.faces) std::swap(f[1], f[2]);
  EXPECT_EQ(Count(views).vertices, 0);
  for (Face& f : garment_.rest.faces) std::swap(f[1], f[2]);
  // Out of the picture; too small.
  rig_.cameras[0].cx_px = 5000;
  EXPECT_EQ(Count(views).vertices, 0);
  rig_.cameras[0].cx_px = 320;
  rig_.cameras[0].fx_px = rig_.cameras[0].fy_px = 100;
  EXPECT_EQ(Count(views).vertices, 0);
  rig_.cameras[0].fx_px = rig_.cameras[0].fy_px = 1500;
  // Cloth that was not measured says nothing of a camera.
  mesh_.state.assign(mesh_.state.size(), VertexState::kInferred);
  EXPECT_EQ(Count(views).vertices, 0);
  mesh_.vertices_mm.pop_back();
  EXPECT_TRUE(CountClothInView(rig_, views, garment_, mesh_).empty());
}

}  // namespace
}  // namespace weft
