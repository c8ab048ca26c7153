#include "triangulation/camera_bias.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/triangulation/synthetic_views.h"

namespace weft {
namespace {

using testing::BentSheet;
using ::testing::HasSubstr;
using testing::Observe;
using testing::RingRig;

std::vector<CameraBias> Biases(const Rig& rig, const std::vector<ViewObservations>& views) {
  const auto cloud = Triangulate(rig, views, {});
  EXPECT_TRUE(cloud.ok()) << cloud.status();
  const auto biases = MeasureCameraBias(rig, views, *cloud, {});
  EXPECT_TRUE(biases.ok()) << biases.status();
  return *biases;
}

TEST(CameraBias, FindsTheCameraThatIsOffAndByHowMuch) {
  const Rig rig = RingRig(12);
  std::vector<ViewObservations> views = Observe(rig, BentSheet(80, 80), 0.1, 1);
  for (Observation& o : views[5].observations) o.x_px += 0.3, o.y_px -= 0.1;
  const std::vector<CameraBias> biases = Biases(rig, views);
  ASSERT_EQ(biases.size(), 12u);
  EXPECT_NEAR(biases[5].mean_px.x(), 0.3, 0.02);
  EXPECT_NEAR(biases[5].mean_px.y(), -0.1, 0.02);
  EXPECT_GT(biases[5].significance, 20);
  for (size_t c = 0; c < biases.size(); ++c) {
    if (c != 5) {
      // The others are pulled along, by the share that the wrong camera has in the points.
      EXPECT_LT(biases[c].mean_px.norm(), 0.08);
    }
    EXPECT_GT(biases[c].observations, 3000);
  }
}

TEST(CameraBias, ACameraThatWasKnockedIsFoundThoughNoPointContainsIt) {
  const Rig filmed = RingRig(8);
  const std::vector<ViewObservations> views = Observe(filmed, BentSheet(80, 80), 0.1, 1);
  Rig rig = filmed;  // as calibrated, before camera 3 turned by 0.05 degrees
  CameraModel& camera = rig.cameras[3];
  const Eigen::Vector3d center = camera.CenterWorld();
  camera.rotation = Eigen::AngleAxisd(0.05 * M_PI / 180, Eigen::Vector3d::UnitY()) * camera.rotation;
  camera.translation_mm = -camera.rotation * center;
  const std::vector<CameraBias> biases = Biases(rig, views);
  const double expected_px = camera.fx_px * 0.05 * M_PI / 180;
  ASSERT_GT(expected_px, 0.9);
  EXPECT_GT(biases[3].observations, 1000);
  EXPECT_NEAR(biases[3].mean_px.norm(), expected_px, 0.1 * expected_px);
  EXPECT_GT(biases[3].significance, 20);
  for (size_t c = 0; c < biases.size(); ++c) {
    if (c == 3) continue;
    EXPECT_LT(biases[c].mean_px.norm(), 0.1) << c;
  }
}

TEST(CameraBias, NoiseAloneIsNotSignificant) {
  const Rig rig = RingRig(10);
  int high = 0;
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    for (const CameraBias& bias : Biases(rig, Observe(rig, BentSheet(80, 80), 0.1, seed))) {
      EXPECT_LT(bias.significance, 5);
      high += bias.significance > 3;
      // Left out: own noise and that of a point of nine cameras.
      EXPECT_NEAR(bias.rms_px, 0.1 * std::sqrt(2.0 * (1 + 3.0 / 18)), 0.02);
    }
  }
  EXPECT_LE(high, 3);  // of 50; 1.1 % in the long run
}

TEST(CameraBias, ErrorsSharedByNeighborsAreNotTakenForCertainty) {
  // Each square of 16 cells has one error in each view, as folds and light make them.
  const Rig rig = RingRig(10);
  int high = 0;
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    std::vector<ViewObservations> views = Observe(rig, BentSheet(96, 96), 0.02, seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> unit(0, 1);
    for (ViewObservations& view : views) {
      double shift[6][6][2];
      for (auto& row : shift)
        for (auto& block : row)
          for (double& s : block) s = 0.1 * unit(random);
      for (Observation& o : view.observations) {
        o.x_px += shift[o.node.row / 16][o.node.col / 16][0];
        o.y_px += shift[o.node.row / 16][o.node.col / 16][1];
      }
    }
    for (const CameraBias& bias : Biases(rig, views)) high += bias.significance > 4;
  }
  EXPECT_LE(high, 1);
}

TEST(CameraBias, TooFewCamerasTellNothing) {
  const Rig rig = RingRig(3);
  for (const CameraBias& bias : Biases(rig, Observe(rig, BentSheet(20, 20), 0.1, 1))) {
    EXPECT_EQ(bias.observations, 0);
    EXPECT_EQ(bias.significance, 0);
  }
  EXPECT_THAT(MeasureCameraBias(rig, {{7, {}}}, {}, {}).status().message(),
              HasSubstr("the rig has 3 cameras"));
}

}  // namespace
}  // namespace weft
