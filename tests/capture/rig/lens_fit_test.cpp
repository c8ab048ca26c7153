#include "capture/rig/lens_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace weft {
namespace {

using ::testing::HasSubstr;

CameraModel WideCamera() {
  CameraModel camera;
  camera.id = "left";
  camera.width_px = 1280;
  camera.height_px = 1024;
  camera.fx_px = 700;
  camera.fy_px = 690;
  camera.cx_px = 630;
  camera.cy_px = 515;
  return camera;
}

// Rays all over the image, and beyond.
std::vector<cv::Point3d> Rays() {
  std::vector<cv::Point3d> rays;
  for (double x = -3; x <= 3; x += 0.1)
    for (double y = -3; y <= 3; y += 0.1) rays.emplace_back(x, y, 1);
  return rays;
}

cv::Matx33d MatrixOf(const CameraModel& camera) {
  return {camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1};
}

// Off the pixels where OpenCV sees the rays, within the image.
double WorstPx(const CameraModel& camera, const std::vector<cv::Point2d>& truth) {
  const std::vector<cv::Point3d> rays = Rays();
  double worst_px = 0;
  int inside = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!camera.Contains({truth[i].x, truth[i].y})) continue;
    const auto seen = camera.Project({rays[i].x, rays[i].y, rays[i].z});
    if (!seen) return 1e9;
    worst_px = std::max(worst_px, std::hypot(seen->x() - truth[i].x, seen->y() - truth[i].y));
    ++inside;
  }
  EXPECT_GT(inside, 300);
  return worst_px;
}

TEST(FitLens, HoldsOpenCvsFisheyeToAHundredthOfAPixel) {
  for (const cv::Vec4d& k : {cv::Vec4d(0.08, -0.02, 0.006, -0.001), cv::Vec4d(0, 0, 0, 0),
                             cv::Vec4d(-0.02, 0.01, -0.01, 0.002), cv::Vec4d(-0.05, 0, 0, 0)}) {
    CameraModel camera = WideCamera();
    std::vector<cv::Point2d> truth;
    const cv::Vec3d none(0, 0, 0);
    cv::fisheye::projectPoints(Rays(), truth, none, none, MatrixOf(camera), k);
    const auto error_px = FitLens(FisheyeRadius({k[0], k[1], k[2], k[3]}), &camera);
    ASSERT_TRUE(error_px.ok()) << error_px.status();
    EXPECT_LT(*error_px, 0.02);
    EXPECT_LT(WorstPx(camera, truth), 0.02);
    EXPECT_TRUE(camera.Validate().ok());
  }
}

TEST(FitLens, FovLensesChangeTheFocalLength) {
  CameraModel camera = WideCamera();
  constexpr double kOmega = 0.8;
  ASSERT_TRUE(FitLens(FovRadius(kOmega), &camera).ok());
  // The definition: the distance in the image is proportional to the angle of another lens.
  for (const double x : {0.1, 0.5, 1.0}) {
    const double expected = 630 + 700 * std::atan(2 * x * std::tan(kOmega / 2)) / kOmega;
    EXPECT_NEAR(camera.Project({x, 0, 1})->x(), expected, 0.01);
  }
}

TEST(FitLens, RefusesWhatItCannotHold) {
  CameraModel camera = WideCamera();
  camera.fx_px = camera.fy_px = 300;  // 640 px are beyond 90 degrees
  EXPECT_THAT(std::string(FitLens(FisheyeRadius({}), &camera).status().message()), HasSubstr("80 degrees"));
  camera = WideCamera();
  EXPECT_THAT(std::string(FitLens(FisheyeRadius({-0.5}), &camera).status().message()),
              HasSubstr("folds back at"));
}

TEST(SetOpenCvDistortion, HoldsTheRationalModelAsOpenCvDoes) {
  const std::vector<double> k = {-0.3, 0.12, 1e-3, -2e-3, 0.02, 0.01, 0.003, -0.001, 0, 0, 0, 0, 0, 0};
  for (const size_t count : {0u, 4u, 5u, 8u, 12u, 14u}) {
    CameraModel camera = WideCamera();
    const std::vector<double> some(k.begin(), k.begin() + static_cast<int>(count));
    ASSERT_TRUE(SetOpenCvDistortion(some, &camera).ok()) << count;
    const std::vector<cv::Point3d> point = {{0.3, -0.2, 1}};
    std::vector<cv::Point2d> truth;
    const cv::Vec3d none(0, 0, 0);
    cv::projectPoints(point, none, none, MatrixOf(camera), some, truth);
    const auto seen = camera.Project({0.3, -0.2, 1});
    ASSERT_TRUE(seen.has_value());
    EXPECT_NEAR(seen->x(), truth[0].x, 1e-9) << count;
    EXPECT_NEAR(seen->y(), truth[0].y, 1e-9) << count;
  }
}

TEST(SetOpenCvDistortion, RefusesTermsThatWeftsLensLacks) {
  CameraModel camera = WideCamera();
  const auto message = [&](size_t count, size_t not_zero) {
    std::vector<double> k(count, 0);
    if (count > not_zero) k[not_zero] = 1e-3;
    return std::string(SetOpenCvDistortion(k, &camera).message());
  };
  EXPECT_THAT(message(12, 10), HasSubstr("thin prism"));
  EXPECT_THAT(message(14, 13), HasSubstr("tilted"));
  EXPECT_THAT(message(13, 0), HasSubstr("13 distortion coefficients"));
  EXPECT_THAT(message(3, 0), HasSubstr("3 distortion coefficients"));
}

}  // namespace
}  // namespace weft
