#include "evaluation/camera_errors.h"

#include <gtest/gtest.h>

#include "evaluation/error_summary.h"
#include "simulation/random.h"
#include "simulation/studio_rig.h"

namespace weft {
namespace {

// 200 nodes before eight cameras; pixels with noise, one camera shifted.
struct Studio {
  Rig rig;
  std::vector<ViewObservations> views;
  Cloud cloud;
};
Studio MakeStudio(double noise_px, int shifted_camera, double shift_px) {
  Studio studio;
  studio.rig = *MakeStudioRig("test", {.cameras = 8, .around_deg = 120});
  for (int i = 0; i < 200; ++i) {
    CloudPoint point;
    point.node = {i / 20, i % 20, NodeKind::kCenter};
    point.position_mm = Eigen::Vector3d(4.0 * (i % 20) - 40, 4.0 * (i / 20) - 20, 3.0 * (i % 7));
    studio.cloud.points.push_back(point);
  }
  for (int c = 0; c < 8; ++c) {
    ViewObservations view;
    view.camera = c;
    for (int i = 0; i < 200; ++i) {
      Eigen::Vector2d pixel = *studio.rig.cameras[c].Project(studio.cloud.points[i].position_mm);
      pixel += noise_px * Eigen::Vector2d(NormalOf(c, 2 * i), NormalOf(c, 2 * i + 1));
      if (c == shifted_camera) pixel.x() += shift_px;
      view.observations.push_back({pixel.x(), pixel.y(), studio.cloud.points[i].node, 0, 1});
    }
    studio.views.push_back(view);
  }
  return studio;
}

TEST(CameraErrors, NoiseIsTheReprojectionError) {
  const Studio studio = MakeStudio(0.1, -1, 0);
  const auto errors = MeasureCameraErrors(studio.rig, studio.views, studio.cloud, {});
  ASSERT_TRUE(errors.ok()) << errors.status();
  ASSERT_EQ(errors->size(), 8u);
  for (const CameraErrors& camera : *errors) {
    EXPECT_EQ(camera.observations, 200);
    EXPECT_EQ(camera.outliers, 0);
    // The cloud is exact here, so this is the length of noise of 0.1 px per axis.
    EXPECT_NEAR(Summarize(camera.reprojection_px)->mean, 0.1 * std::sqrt(M_PI / 2), 0.02);
    EXPECT_GT(Summarize(camera.left_out_px)->mean, Summarize(camera.reprojection_px)->mean);
    EXPECT_LT(Summarize(camera.left_out_px)->mean, 0.25);
  }
}

TEST(CameraErrors, LeavingOutFindsTheShiftedCamera) {
  const Studio studio = MakeStudio(0.02, 3, 0.8);
  const auto errors = MeasureCameraErrors(studio.rig, studio.views, studio.cloud, {});
  ASSERT_TRUE(errors.ok()) << errors.status();
  for (const CameraErrors& camera : *errors) {
    const double left_out = Summarize(camera.left_out_px)->median;
    const Eigen::Vector2d shift = camera.shift_sum_px / static_cast<double>(camera.left_out_px.size());
    if (camera.camera_id == studio.rig.cameras[3].id) {
      EXPECT_NEAR(left_out, 0.8, 0.1);
      EXPECT_NEAR(shift.x(), -0.8, 0.1);
    } else {
      EXPECT_LT(left_out, 0.4);
    }
  }
}

TEST(CameraErrors, WrongIdentitiesAreOutliers) {
  Studio studio = MakeStudio(0.02, -1, 0);
  studio.views[2].observations[5].node = {0, 6, NodeKind::kCenter};  // now twice in this view
  const auto errors = MeasureCameraErrors(studio.rig, studio.views, studio.cloud, {});
  ASSERT_TRUE(errors.ok()) << errors.status();
  EXPECT_EQ((*errors)[2].outliers, 1);
  EXPECT_EQ((*errors)[1].outliers, 0);
}

TEST(CameraErrors, ViewsOfUnknownCamerasAreRefused) {
  Studio studio = MakeStudio(0, -1, 0);
  studio.views[0].camera = 8;
  EXPECT_FALSE(MeasureCameraErrors(studio.rig, studio.views, studio.cloud, {}).ok());
}

}  // namespace
}  // namespace weft
