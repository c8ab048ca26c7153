#include "services/results/report/image_overlay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
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

// A picture read back, with the value of a channel at a place.
class Shown {
 public:
  explicit Shown(const absl::StatusOr<MeshPicture>& picture) {
    EXPECT_TRUE(picture.ok()) << picture.status();
    const TempFolder folder;
    WriteBytes(folder / "overlay.jpg", picture->bytes);
    const auto read = ReadImageFile(folder / "overlay.jpg");
    EXPECT_TRUE(read.ok()) << read.status();
    image_ = *read;
    EXPECT_EQ(image_.width_px, picture->width_px);
    EXPECT_EQ(image_.height_px, picture->height_px);
  }
  int At(int x, int y, int channel = 1) const {
    return image_.row(y)[3 * static_cast<ptrdiff_t>(x) + channel];
  }
  std::string Size() const {
    return std::to_string(image_.width_px) + "x" + std::to_string(image_.height_px);
  }

 private:
  Frame image_;
};

// The square covers pixels 100 to 299 of the image; the picture begins at its pixel 87.
TEST(ImageOverlay, TheOutlineIsBlackInsideAndWhiteOutside) {
  const Square square = MakeSquare();
  const Shown shown(DrawOverlay(GreyImage(128), Camera(), square.mesh, square.faces, {.jpeg_quality = 100}));
  EXPECT_EQ(shown.Size(), "226x226");
  for (const auto& [beside, outside, edge, inside] :
       {std::array{10, 12, 13, 16}, std::array{215, 213, 212, 209}}) {
    EXPECT_NEAR(shown.At(beside, 60), 128, 12);
    EXPECT_GT(shown.At(outside, 60), 225);
    EXPECT_LT(shown.At(edge, 60), 30);
    EXPECT_NEAR(shown.At(60, beside), 128, 12);
    EXPECT_GT(shown.At(60, outside), 225);
    EXPECT_LT(shown.At(60, edge), 30);
    EXPECT_NEAR(shown.At(60, inside), 128, 12);
  }
  // Half of the grey and half of the colour.
  for (const auto& [channel, value] : {std::pair{0, 179}, {1, 143}, {2, 64}})
    EXPECT_NEAR(shown.At(160, 60, channel), value, 4);
  const Shown faint(
      DrawOverlay(GreyImage(128), Camera(), square.mesh, square.faces, {.tint = 0.25, .jpeg_quality = 100}));
  EXPECT_NEAR(faint.At(160, 60, 2), 96, 4);
}

TEST(ImageOverlay, PicturesAreAsLargeAsTheyMayBe) {
  const Square square = MakeSquare();
  const auto size = [&](const OverlayOptions& options) {
    return Shown(DrawOverlay(GreyImage(128), Camera(), square.mesh, square.faces, options)).Size();
  };
  EXPECT_EQ(size({.width_px = 113}), "113x113");
  EXPECT_EQ(size({.height_px = 50}), "50x50");
  EXPECT_EQ(size({.margin_share = 0}), "202x202");
  EXPECT_EQ(size({.margin_share = 9}), "400x400") << "the image ends there";
}

// Cloth before other cloth has an outline where the step is more than 15 pixels of depth.
TEST(ImageOverlay, StepsInDepthHaveAnOutline) {
  const auto at_edge = [](double near_mm) {
    Square square = MakeSquare();
    for (VertexState& state : square.mesh.state) state = VertexState::kObserved;
    const int first = static_cast<int>(square.mesh.vertices_mm.size());
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      square.mesh.vertices_mm.emplace_back(0.1 * near_mm * x, 0.1 * near_mm * y, near_mm);
      square.mesh.state.push_back(VertexState::kObserved);
    }
    square.faces.push_back({first, first + 3, first + 2});
    square.faces.push_back({first, first + 2, first + 1});
    const Shown shown(
        DrawOverlay(GreyImage(128), Camera(), square.mesh, square.faces, {.jpeg_quality = 100}));
    // It spans pixels 150 to 249 of the image.
    return std::pair(shown.At(62, 113), shown.At(63, 113));
  };
  const auto [white, black] = at_edge(965);
  EXPECT_GT(white, 225);
  EXPECT_LT(black, 30);
  const auto [beside, inside] = at_edge(975);
  EXPECT_NEAR(beside, 128, 6);
  EXPECT_NEAR(inside, 128, 6);
}

}  // namespace
}  // namespace weft
