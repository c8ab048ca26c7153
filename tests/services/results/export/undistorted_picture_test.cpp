#include "services/results/export/undistorted_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace weft {
namespace {

using ::testing::HasSubstr;

// A lens that bends lines by several pixels, with pixels that are not square.
CameraModel Lens() {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = 240;
  camera.height_px = 180;
  camera.fx_px = 300;
  camera.fy_px = 330;
  camera.cx_px = 124;
  camera.cy_px = 85;
  camera.distortion = {-0.3, 0.1, 0.002, -0.001, 0, 0, 0, 0};
  camera.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  camera.translation_mm = {10, 20, 800};
  return camera;
}

// A soft dot at this pixel, in red.
Frame DotAt(const Eigen::Vector2d& at, const CameraModel& camera) {
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const double far = (Eigen::Vector2d(x, y) - at).squaredNorm();
      pixels->insert(pixels->end(), {static_cast<uint8_t>(std::lround(255 * std::exp(-far / 8))), 0, 0});
    }
  }
  Frame frame;
  frame.width_px = camera.width_px;
  frame.height_px = camera.height_px;
  frame.format = PixelFormat::kRgb8;
  frame.pixels = std::move(pixels);
  return frame;
}

Eigen::Vector2d CentreOfDot(const Frame& frame) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double all = 0;
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = 0; x < frame.width_px; ++x) {
      const double red = frame.row(y)[3 * x];
      sum += red * Eigen::Vector2d(x, y);
      all += red;
    }
  }
  return sum / all;
}

TEST(UndistortPicture, PointsAreWhereThePinholeSeesThem) {
  const CameraModel lens = Lens(), pinhole = WithoutDistortion(lens);
  EXPECT_EQ(pinhole.fy_px, lens.fx_px);
  double farthest_px = 0;
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(124, 85), {40, 30}, {200, 40}, {60, 140}, {210, 150}}) {
    // The point of the world that the lens sees there.
    const std::optional<Ray> ray = lens.PixelRay(at);
    ASSERT_TRUE(ray);
    const std::optional<Eigen::Vector2d> expected = pinhole.Project(ray->origin_mm + 900 * ray->direction);
    ASSERT_TRUE(expected);
    farthest_px = std::max(farthest_px, (*expected - at).norm());
    const absl::StatusOr<Frame> picture = UndistortPicture(DotAt(at, lens), lens);
    ASSERT_TRUE(picture.ok()) << picture.status();
    EXPECT_LT((CentreOfDot(*picture) - *expected).norm(), 0.1) << at.transpose();
  }
  EXPECT_GT(farthest_px, 3) << "the lens bends enough to tell";
}

TEST(UndistortPicture, IsBlackWhereTheLensSawNothing) {
  CameraModel pincushion = Lens();
  pincushion.distortion = {0.4, 0, 0, 0, 0, 0, 0, 0};
  Frame white = DotAt({0, 0}, pincushion);
  white.pixels = std::make_shared<std::vector<uint8_t>>(white.pixels->size(), uint8_t{255});
  const absl::StatusOr<Frame> picture = UndistortPicture(white, pincushion);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_EQ(picture->row(0)[0], 0);
  EXPECT_EQ(picture->row(85)[3 * 124], 255);
}

TEST(UndistortPicture, RefusesPicturesOfAnotherSize) {
  const CameraModel lens = Lens();
  Frame frame = DotAt({10, 10}, lens);
  frame.width_px = 120;
  EXPECT_THAT(UndistortPicture(frame, lens).status().message(), HasSubstr("camera c: is 240x180 px"));
}

}  // namespace
}  // namespace weft
