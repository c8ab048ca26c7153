#include "capture/rig/camera_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

namespace weft {
namespace {

CameraModel Camera(const std::array<double, 8>& distortion) {
  CameraModel camera;
  camera.id = "400038";
  camera.width_px = 2668;
  camera.height_px = 4096;
  camera.fx_px = 2420;
  camera.fy_px = 2405;
  camera.cx_px = 1185;
  camera.cy_px = 2049;
  camera.distortion = distortion;
  camera.rotation = Eigen::AngleAxisd(0.8, Eigen::Vector3d(0.3, -1, 0.4).normalized()).toRotationMatrix();
  camera.translation_mm = {35, -120, 1900};
  return camera;
}

// Lenses as one meets them, up to distortions that move the corners of the image by hundreds of pixels.
std::vector<CameraModel> Cameras() {
  return {Camera({}), Camera({-0.12, 0.35, 4e-4, -3e-4, -0.2}), Camera({-0.32, 0.16, 2e-3, -3e-3, -0.02}),
          Camera({0.25, 0.1, -1e-3, 2e-3, 0.01}), Camera({0.3, 0.05, 1e-3, 5e-4, 0.01, 0.5, 0.02, 0.004})};
}

class Lens : public ::testing::TestWithParam<int> {
 protected:
  const CameraModel camera = Cameras()[GetParam()];
};
INSTANTIATE_TEST_SUITE_P(CameraModel, Lens, ::testing::Range(0, 5));

// World points whose images, by OpenCV, lie on the sensor.
struct ProjectedByOpenCv {
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixel;
};
ProjectedByOpenCv RandomPoints(const CameraModel& camera, int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  ProjectedByOpenCv out;
  for (int i = 0; i < count; ++i) {
    const double depth = 1500 + 700 * unit(random);
    const Eigen::Vector3d in_camera(0.55 * unit(random) * depth, 0.85 * unit(random) * depth, depth);
    const Eigen::Vector3d p = camera.rotation.transpose() * (in_camera - camera.translation_mm);
    out.world.emplace_back(p.x(), p.y(), p.z());
  }
  cv::Matx33d rotation, intrinsics(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  for (int i = 0; i < 9; ++i) rotation.val[i] = camera.rotation(i / 3, i % 3);
  cv::Vec3d rodrigues;
  cv::Rodrigues(rotation, rodrigues);
  const Eigen::Vector3d& t = camera.translation_mm;
  cv::projectPoints(out.world, rodrigues, cv::Vec3d(t.x(), t.y(), t.z()), intrinsics,
                    std::vector<double>(camera.distortion.begin(), camera.distortion.end()), out.pixel);
  return out;
}

TEST_P(Lens, ProjectsAsOpenCvDoes) {
  ASSERT_TRUE(camera.Validate().ok());
  const ProjectedByOpenCv expected = RandomPoints(camera, 500);
  int on_sensor = 0;
  for (size_t i = 0; i < expected.world.size(); ++i) {
    const Eigen::Vector2d pixel(expected.pixel[i].x, expected.pixel[i].y);
    if (!camera.Contains(pixel)) continue;
    ++on_sensor;
    const auto projected = camera.Project({expected.world[i].x, expected.world[i].y, expected.world[i].z});
    ASSERT_TRUE(projected.has_value());
    EXPECT_LT((*projected - pixel).norm(), 1e-6);
  }
  EXPECT_GT(on_sensor, 200);
}

TEST_P(Lens, UndistortInvertsProjectUpToTheCorners) {
  for (double x = -0.5; x <= camera.width_px; x += 127) {
    for (double y = -0.5; y <= camera.height_px; y += 163) {
      const auto ray = camera.PixelRay({x, y});
      ASSERT_TRUE(ray.has_value()) << x << " " << y;
      EXPECT_NEAR(ray->direction.norm(), 1, 1e-12);
      const auto back = camera.Project(ray->origin_mm + 2345 * ray->direction);
      ASSERT_TRUE(back.has_value()) << x << " " << y;
      EXPECT_LT((*back - Eigen::Vector2d(x, y)).norm(), 1e-5);
    }
  }
}

TEST_P(Lens, DerivativeEqualsDifferences) {
  const Eigen::Vector3d in_camera(250, -400, 1300);
  const Eigen::Vector3d p = camera.rotation.transpose() * (in_camera - camera.translation_mm);
  const auto projection = camera.ProjectWithDerivative(p);
  ASSERT_TRUE(projection.has_value());
  EXPECT_NEAR(projection->depth_mm, 1300, 1e-9);
  EXPECT_LT((projection->pixel_px - *camera.Project(p)).norm(), 1e-9);
  constexpr double kStep = 1e-3;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector2d slope = (*camera.Project(p + step) - *camera.Project(p - step)) / (2 * kStep);
    EXPECT_LT((projection->d_pixel_d_world.col(axis) - slope).norm(), 1e-6);
  }
}

TEST(CameraModel, PixelZeroIsTheCentreOfTheFirstPixel) {
  CameraModel camera = Camera({});
  EXPECT_TRUE(camera.Contains({-0.5, -0.5}));
  EXPECT_FALSE(camera.Contains({-0.51, 0}));
  EXPECT_TRUE(camera.Contains({2667.5, 4095.5}));
  EXPECT_FALSE(camera.Contains({2667.51, 0}));
}

TEST(CameraModel, SeesNothingBehindItself) {
  const CameraModel camera = Camera({});
  const Eigen::Vector3d forward = camera.rotation.row(2);
  EXPECT_TRUE(camera.Project(camera.CenterWorld() + 100 * forward).has_value());
  EXPECT_FALSE(camera.Project(camera.CenterWorld()).has_value());
  EXPECT_FALSE(camera.Project(camera.CenterWorld() - 100 * forward).has_value());
}

// With k1 = -0.32 alone the polynomial turns at r = 1.02; what lies further out would come back into the
// image.
TEST(CameraModel, DropsPointsThatTheLensPolynomialFoldsBack) {
  const CameraModel camera = Camera({-0.32});
  const auto at = [&](double radius) {
    const Eigen::Vector3d in_camera(0, 1000 * radius, 1000);
    return Eigen::Vector3d(camera.rotation.transpose() * (in_camera - camera.translation_mm));
  };
  EXPECT_TRUE(camera.Project(at(1.0)).has_value());
  EXPECT_FALSE(camera.Project(at(1.05)).has_value());
  EXPECT_FALSE(camera.Project(at(1.7)).has_value());
  // The largest radius that any point reaches is 2/3 of 1.02; no ray leads to pixels beyond.
  EXPECT_FALSE(camera.Undistort({camera.cx_px, camera.cy_px + 0.7 * camera.fy_px}).has_value());
}

}  // namespace
}  // namespace weft
