#include "services/results/export/overlay_drawing.h"

#include <gmock/gmock.h>

namespace weft {
namespace {

constexpr int kDrawnSidePx = 100;

// Looks along +z from the origin; 1 mm at 1000 mm is 1 px.
CameraModel Camera() {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = camera.height_px = kDrawnSidePx;
  camera.fx_px = camera.fy_px = 1000;
  camera.cx_px = camera.cy_px = 50;
  return camera;
}

Frame GreyPicture() {
  Frame frame;
  frame.width_px = frame.height_px = kDrawnSidePx;
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(kDrawnSidePx * kDrawnSidePx, uint8_t{100});
  return frame;
}

// A square from -20 to 20 mm at this depth, whose outside faces the camera.
void AddSquare(double depth_mm, const Eigen::Vector3f& color, OverlayMesh& mesh) {
  const int v = static_cast<int>(mesh.vertices_mm.size());
  for (const auto& [x, y] : {std::pair(-20, -20), std::pair(20, -20), std::pair(20, 20), std::pair(-20, 20)})
    mesh.vertices_mm.emplace_back(x, y, depth_mm);
  mesh.faces.push_back({v, v + 2, v + 1});
  mesh.faces.push_back({v, v + 3, v + 2});
  mesh.colors.insert(mesh.colors.end(), 4, color);
}

Eigen::Vector3i PixelAt(const Frame& frame, int x, int y) {
  const uint8_t* rgb = frame.row(y) + 3 * x;
  return {rgb[0], rgb[1], rgb[2]};
}

TEST(DrawOverlayTest, PaintsFacesWhereTheCameraSeesThem) {
  OverlayMesh mesh;
  AddSquare(1000, {1, 0, 0}, mesh);
  const auto drawn = DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kState);
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_EQ(PixelAt(*drawn, 5, 5), Eigen::Vector3i(100, 100, 100));
  for (const auto& [x, y] : {std::pair(32, 32), std::pair(50, 45), std::pair(68, 66)}) {
    EXPECT_GT(PixelAt(*drawn, x, y).x(), 150);
    EXPECT_LT(PixelAt(*drawn, x, y).y(), 60);
  }
  EXPECT_EQ(PixelAt(*drawn, 74, 50), Eigen::Vector3i(100, 100, 100));
}

TEST(DrawOverlayTest, LeavesOutWhatTheMeshHides) {
  OverlayMesh mesh;
  AddSquare(1000, {0, 1, 0}, mesh);
  AddSquare(1005, {1, 0, 0}, mesh);
  const auto drawn = DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kSigma);
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_GT(PixelAt(*drawn, 50, 45).y(), 150);
  EXPECT_LT(PixelAt(*drawn, 50, 45).x(), 60);
}

TEST(DrawOverlayTest, LeavesOutInsides) {
  OverlayMesh mesh;
  AddSquare(1000, {0, 1, 0}, mesh);
  for (Face& face : mesh.faces) std::swap(face[0], face[1]);
  const auto drawn = DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kState);
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_EQ(PixelAt(*drawn, 50, 45), Eigen::Vector3i(100, 100, 100));
}

TEST(DrawOverlayTest, DrawsEdges) {
  OverlayMesh mesh;
  AddSquare(1000, {0, 0, 1}, mesh);
  const auto drawn = DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kWireframe);
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  EXPECT_GT(PixelAt(*drawn, 30, 50).z(), 200);
  EXPECT_GT(PixelAt(*drawn, 50, 50).z(), 200);  // the diagonal
  EXPECT_EQ(PixelAt(*drawn, 60, 40), Eigen::Vector3i(100, 100, 100));
}

TEST(DrawOverlayTest, NamesBackAndForth) {
  for (const OverlayKind kind : {OverlayKind::kWireframe, OverlayKind::kState, OverlayKind::kSigma})
    EXPECT_EQ(*OverlayKindFromName(NameOf(kind)), kind);
  EXPECT_FALSE(OverlayKindFromName("x").ok());
}

TEST(DrawOverlayTest, ColoursCoverTheirShareOfThePicture) {
  OverlayMesh mesh;
  AddSquare(1000, {1, 0, 0.5F}, mesh);
  const auto drawn = DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kState);
  ASSERT_TRUE(drawn.ok()) << drawn.status();
  // 55 of 100 of the colour on 45 of the grey.
  EXPECT_EQ(PixelAt(*drawn, 60, 45), Eigen::Vector3i(185, 45, 115));
  mesh.colors = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
  const auto mixed = DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kState);
  ASSERT_TRUE(mixed.ok()) << mixed.status();
  EXPECT_EQ(PixelAt(*mixed, 60, 40), Eigen::Vector3i(92, 92, 92)) << "the mean of the corners";
}

TEST(DrawOverlayTest, ColoursAreAsManyAsVertices) {
  OverlayMesh mesh;
  AddSquare(1000, {1, 0, 0}, mesh);
  mesh.colors.pop_back();
  EXPECT_EQ(DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kState).status(),
            absl::InvalidArgumentError("colors: there are 3 for 4 vertices"));
  EXPECT_TRUE(DrawOverlay(GreyPicture(), mesh, Camera(), OverlayKind::kNone).ok()) << "nothing is drawn";
  EXPECT_EQ(OverlayKindFromName("x").status().message(),
            "--overlay: \"x\" is not one of wireframe, state, sigma, none");
  EXPECT_EQ(*OverlayKindFromName("none"), OverlayKind::kNone);
}

}  // namespace
}  // namespace weft
