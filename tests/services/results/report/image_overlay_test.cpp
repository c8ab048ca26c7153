#include "services/results/report/image_overlay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <memory>

#include "capture/image/image_file.h"
#include "services/results/report/frame_overlays.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kSide_px = 400;

// Looks along z at a plane 1 m away, 0.5 px a mm.
CameraModel Camera() {
  CameraModel camera;
  camera.id = "c00";
  camera.width_px = camera.height_px = kSide_px;
  camera.fx_px = camera.fy_px = 500;
  camera.cx_px = camera.cy_px = 199.5;
  return camera;
}

Frame GreyImage(uint8_t value) {
  Frame image;
  image.width_px = image.height_px = kSide_px;
  image.pixels = std::make_shared<std::vector<uint8_t>>(size_t{kSide_px} * kSide_px, value);
  return image;
}

// A square of 400 mm in the middle, 1 m away; its right half is inferred.
struct Square {
  RegisteredMesh mesh;
  std::vector<Face> faces;
};
Square MakeSquare() {
  constexpr int kSteps = 40;
  Square square;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      square.mesh.vertices_mm.emplace_back(10.0 * j - 200, 10.0 * i - 200, 1000);
      square.mesh.state.push_back(2 * j < kSteps ? VertexState::kObserved : VertexState::kInferred);
      if (i == kSteps || j == kSteps) continue;
      const int v = i * (kSteps + 1) + j;
      square.faces.push_back({v, v + kSteps + 1, v + 1});
      square.faces.push_back({v + 1, v + kSteps + 1, v + kSteps + 2});
    }
  square.mesh.sigma_mm.assign(square.mesh.state.size(), 0.1f);
  square.mesh.views.assign(square.mesh.state.size(), 3);
  return square;
}

TEST(ImageOverlay, OutlinesTheMeshAndTintsWhatIsNotObserved) {
  const Square square = MakeSquare();
  const auto picture =
      DrawOverlay(GreyImage(128), Camera(), square.mesh, square.faces, {.jpeg_quality = 100});
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->type, "image/jpeg");
  EXPECT_EQ(picture->title, "Camera c00");
  TempFolder folder;
  std::ofstream(folder / "overlay.jpg", std::ios::binary) << picture->bytes;
  const auto shown = ReadImageFile(folder / "overlay.jpg");
  ASSERT_TRUE(shown.ok()) << shown.status();
  // 200 px and a margin on both sides.
  EXPECT_NEAR(shown->width_px, 225, 2);
  const auto pixel = [&](int x, int y) { return shown->row(y) + 3 * static_cast<ptrdiff_t>(x); };
  const int middle = shown->width_px / 2, edge = (shown->width_px - 200) / 2;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel(middle - 40, middle)[c], 128, 6) << c;  // observed: untouched
  EXPECT_GT(pixel(middle + 40, middle)[0], pixel(middle + 40, middle)[2] + 60);         // inferred: orange
  uint8_t darkest = 255, lightest = 0;
  for (int x = edge - 4; x <= edge + 4; ++x) {
    darkest = std::min(darkest, pixel(x, middle)[1]);
    lightest = std::max(lightest, pixel(x, middle)[1]);
  }
  EXPECT_LT(darkest, 60);
  EXPECT_GT(lightest, 190);
  EXPECT_NEAR(pixel(3, 3)[1], 128, 6);  // beside the mesh
}

TEST(ImageOverlay, WhatDoesNotFitIsRefused) {
  Square square = MakeSquare();
  for (Eigen::Vector3d& vertex : square.mesh.vertices_mm) vertex.x() += 5000;
  const auto nothing = DrawOverlay(GreyImage(128), Camera(), square.mesh, square.faces);
  EXPECT_EQ(nothing.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(nothing.status().message(), HasSubstr("c00"));
  CameraModel other = Camera();
  other.width_px = 100;
  EXPECT_FALSE(DrawOverlay(GreyImage(128), other, MakeSquare().mesh, square.faces).ok());
}

TEST(CamerasToShow, AreTheBestOneAndTheBestFromAnotherSide) {
  Rig rig;
  v1::FrameReport report;
  const auto add = [&](const std::string& id, double turn_deg, int centers, const std::string& missing = "") {
    CameraModel camera = Camera();
    camera.id = id;
    camera.rotation = Eigen::AngleAxisd(turn_deg * M_PI / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
    rig.cameras.push_back(camera);
    v1::ViewReport& view = *report.add_views();
    view.set_camera(id);
    view.set_centers(centers);
    view.set_missing_reason(missing);
  };
  add("beside", 20, 900);
  add("best", 0, 1000);
  add("lost", 180, 5000, "no file");
  add("behind", 170, 400);
  add("left", 90, 500);
  EXPECT_THAT(CamerasToShow(rig, report), ElementsAre(1, 4));
  report.clear_views();
  EXPECT_TRUE(CamerasToShow(rig, report).empty());
}

}  // namespace
}  // namespace weft
