#include "capture/calibration/view_equations.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

struct OneView {
  TagBoard board{"A", "tag36h11", 4, 3, 30, 10, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
  CameraModel camera;
  RigidPose pose;
  CameraUnknowns camera_unknowns;
  PlacementUnknowns pose_unknowns;
  WarpUnknowns warp_unknowns{0.7, -0.4, 0.3, 2e-3};

  OneView() {
    camera.id = "c";
    camera.width_px = 2000;
    camera.height_px = 1500;
    camera.fx_px = 2100;
    camera.fy_px = 2080;
    camera.cx_px = 900;
    camera.cy_px = 800;
    camera.distortion = {-0.12, 0.08, 1e-3, -2e-3, 0.02, 0.03, -0.01, 0.004};
    camera.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    camera.translation_mm = {40, -30, 900};
    pose.rotation = Eigen::AngleAxisd(0.6, Eigen::Vector3d(-1, 1, 3).normalized()).toRotationMatrix();
    pose.translation_mm = {-20, 15, 60};
    camera_unknowns = UnknownsOf(camera);
    pose_unknowns = UnknownsOf(pose);
    // Away from zero, so that the derivative of a turn at a turned state is tested too.
    for (int i = 9; i < 12; ++i) camera_unknowns[i] = 0.05 * (i - 8);
    for (int i = 0; i < 3; ++i) pose_unknowns[i] = -0.04 * (i + 1);
  }
  ViewState State() const {
    return {&camera, camera_unknowns.data(), &pose, pose_unknowns.data(), &board, warp_unknowns.data()};
  }
  double& Unknown(int i) {
    if (i < kCameraUnknowns) return camera_unknowns[i];
    if (i < kCameraUnknowns + kPlacementUnknowns) return pose_unknowns[i - kCameraUnknowns];
    return warp_unknowns[i - kCameraUnknowns - kPlacementUnknowns];
  }
};

TEST(ViewEquations, DerivativesAreThoseOfTheProjection) {
  OneView one;
  for (const int corner : {0, 17, 46}) {
    Eigen::Vector2d at;
    Eigen::Matrix<double, 2, kViewUnknowns> derivative;
    ASSERT_TRUE(ProjectCorner(one.State(), corner, &at, &derivative));
    for (int i = 0; i < kViewUnknowns; ++i) {
      double& unknown = one.Unknown(i);
      const double before = unknown, step = 1e-5 * std::max(1e-1, std::abs(before));
      Eigen::Vector2d above, below;
      unknown = before + step;
      ASSERT_TRUE(ProjectCorner(one.State(), corner, &above, nullptr));
      unknown = before - step;
      ASSERT_TRUE(ProjectCorner(one.State(), corner, &below, nullptr));
      unknown = before;
      const Eigen::Vector2d numeric = (above - below) / (2 * step);
      EXPECT_LT((numeric - derivative.col(i)).norm(), 1e-5 * std::max(1.0, numeric.norm()))
          << "corner " << corner << ", unknown " << i << ": " << numeric.transpose() << " against "
          << derivative.col(i).transpose();
    }
  }
}

TEST(ViewEquations, ProjectsAsTheCameraModelDoes) {
  OneView one;
  const CameraModel camera = CameraWith(one.camera, one.camera_unknowns.data());
  const RigidPose pose = PoseWith(one.pose, one.pose_unknowns.data());
  const Eigen::Vector2d flat = FlatCorner(one.board, 21).head<2>();
  const auto pixel = camera.Project(pose * WarpedPoint(one.board, WarpWith(one.warp_unknowns.data()), flat));
  Eigen::Vector2d at;
  ASSERT_TRUE(pixel && ProjectCorner(one.State(), 21, &at, nullptr));
  EXPECT_LT((*pixel - at).norm(), 1e-9);
}

TEST(ViewEquations, FarResidualsCountLinearly) {
  OneView one;
  Eigen::Vector2d at;
  ASSERT_TRUE(ProjectCorner(one.State(), 5, &at, nullptr));
  ViewSums sums;
  SumView(one.State(), {{5, at + Eigen::Vector2d(8, 6)}}, 2.0, 3.0, true, &sums);  // 10 px, 5 sigmas
  EXPECT_NEAR(sums.robust_cost, 3 * (2 * 5 - 3), 1e-9);
  EXPECT_NEAR(sums.factor.col(kViewUnknowns).squaredNorm(), 5 * 5 * 3.0 / 5, 1e-9);
}

}  // namespace
}  // namespace weft
