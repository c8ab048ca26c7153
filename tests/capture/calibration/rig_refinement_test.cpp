#include "capture/calibration/rig_refinement.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "simulation/studio_rig.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr double kNoisePx = 0.1;

// Cameras around points on a cylinder, each seen by the cameras that it faces.
struct Filmed {
  Rig rig;  // that filmed
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<PointSight> sights;

  explicit Filmed(int cameras = 16) {
    StudioRigOptions options;
    options.cameras = cameras;
    options.distance_mm = 2000;
    options.object_width_mm = 400;
    options.object_height_mm = 600;
    rig = MakeStudioRig("studio", options).value();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> around(0, 2 * std::numbers::pi), along(-250, 250);
    std::normal_distribution<double> noise(0, kNoisePx);
    for (int p = 0; p < 1500; ++p) {
      const double angle = around(random);
      const Eigen::Vector3d normal(std::cos(angle), 0, std::sin(angle));
      points_mm.push_back(150 * normal + Eigen::Vector3d(0, along(random), 0));
      for (int c = 0; c < cameras; ++c) {
        const CameraModel& camera = rig.cameras[c];
        if (normal.dot((camera.CenterWorld() - points_mm.back()).normalized()) < 0.2) continue;
        const auto pixel = camera.Project(points_mm.back());
        if (!pixel || !camera.Contains(*pixel)) continue;
        const double x = noise(random), y = noise(random);
        sights.push_back({c, p, *pixel + Eigen::Vector2d(x, y), kNoisePx});
      }
    }
  }

  // The rig as it was calibrated, before camera 3 was knocked.
  Rig BeforeTheKnock(double turned_deg) const {
    Rig before = rig;
    CameraModel& camera = before.cameras[3];
    const Eigen::Vector3d center = camera.CenterWorld();
    camera.rotation =
        Eigen::AngleAxisd(turned_deg * std::numbers::pi / 180, Eigen::Vector3d(1, 2, 0).normalized()) *
        camera.rotation;
    camera.translation_mm = -camera.rotation * center;
    return before;
  }
};

double AngleDeg(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a * b.transpose()).angle() * 180 / std::numbers::pi;
}

TEST(RefineRig, ACameraThatWasKnockedIsFoundAndSetRight) {
  const Filmed filmed;
  const Rig before = filmed.BeforeTheKnock(0.05);
  const auto refined = RefineRig(before, filmed.points_mm, filmed.sights, {});
  ASSERT_TRUE(refined.ok()) << refined.status();
  EXPECT_TRUE(refined->converged);
  for (size_t c = 0; c < filmed.rig.cameras.size(); ++c) {
    const CameraCorrection& correction = refined->corrections[c];
    EXPECT_EQ(correction.moved, c == 3) << c << ": " << correction.shift_px;
    // Points that few cameras see follow their noise.
    EXPECT_GT(correction.after_rms_px, 0.7 * kNoisePx) << c;
    EXPECT_LT(correction.after_rms_px, 1.05 * kNoisePx) << c;
    EXPECT_LT(AngleDeg(refined->cameras[c].rotation, filmed.rig.cameras[c].rotation), 0.01) << c;
  }
  EXPECT_NEAR(refined->corrections[3].rotation_deg, 0.05, 0.01);
  EXPECT_GT(refined->corrections[3].before_rms_px, 1);
}

TEST(RefineRig, ARigThatIsRightStaysWithinItsSigmas) {
  const Filmed filmed;
  const auto refined = RefineRig(filmed.rig, filmed.points_mm, filmed.sights, {});
  ASSERT_TRUE(refined.ok()) << refined.status();
  for (size_t c = 0; c < filmed.rig.cameras.size(); ++c) {
    const CameraCorrection& correction = refined->corrections[c];
    EXPECT_FALSE(correction.moved);
    Eigen::Matrix<double, 6, 1> error;
    const Eigen::AngleAxisd turn(refined->cameras[c].rotation * filmed.rig.cameras[c].rotation.transpose());
    error << turn.angle() * turn.axis(),
        refined->cameras[c].CenterWorld() - filmed.rig.cameras[c].CenterWorld();
    // The prior holds the start, which is the truth: errors are smaller than sigmas, never larger. 6
    // unknowns: more than 28 has a chance of 1e-4.
    EXPECT_LT(error.dot(correction.covariance.ldlt().solve(error)), 28) << c;
  }
}

TEST(RefineRig, WrongSightsDoNotPull) {
  Filmed filmed;
  for (size_t s = 0; s < filmed.sights.size(); s += 50) filmed.sights[s].pixel_px += Eigen::Vector2d(8, -6);
  const auto refined = RefineRig(filmed.rig, filmed.points_mm, filmed.sights, {});
  ASSERT_TRUE(refined.ok()) << refined.status();
  for (size_t c = 0; c < filmed.rig.cameras.size(); ++c)
    EXPECT_LT(AngleDeg(refined->cameras[c].rotation, filmed.rig.cameras[c].rotation), 0.01) << c;
}

// Cloth whose folds move is another shape a frame later, which no pose explains.
TEST(RefineRig, ALateCameraStaysAndPullsNoOther) {
  Filmed filmed;
  for (PointSight& sight : filmed.sights) {
    if (sight.camera != 9) continue;
    const Eigen::Vector3d& point = filmed.points_mm[sight.point];
    const Eigen::Vector3d later(1.5 * std::sin(0.05 * point.y()), 0, 1.5 * std::cos(0.05 * point.y()));
    const auto pixel = filmed.rig.cameras[9].Project(point + later);
    ASSERT_TRUE(pixel.has_value());
    sight.pixel_px = *pixel;
  }
  const Rig before = filmed.BeforeTheKnock(0.05);
  const auto refined = RefineRig(before, filmed.points_mm, filmed.sights, {});
  ASSERT_TRUE(refined.ok()) << refined.status();
  for (int c = 0; c < 16; ++c) {
    const CameraCorrection& correction = refined->corrections[c];
    EXPECT_EQ(correction.misfit, c == 9) << c;
    EXPECT_EQ(correction.held, c == 9) << c;
    EXPECT_EQ(correction.moved, c == 3) << c;
    EXPECT_LT(AngleDeg(refined->cameras[c].rotation, filmed.rig.cameras[c].rotation), 0.01) << c;
  }
  EXPECT_EQ(refined->cameras[9].rotation, before.cameras[9].rotation);
  EXPECT_GT(refined->corrections[9].after_median_px, 0.2);
  EXPECT_LT(refined->corrections[8].after_median_px, 0.2);
}

TEST(RefineRig, CamerasWithFewSightsStay) {
  Filmed filmed;
  int left = 50;
  std::erase_if(filmed.sights, [&](const PointSight& s) { return s.camera == 3 && left-- <= 0; });
  const Rig before = filmed.BeforeTheKnock(0.05);
  const auto refined = RefineRig(before, filmed.points_mm, filmed.sights, {});
  ASSERT_TRUE(refined.ok()) << refined.status();
  EXPECT_TRUE(refined->corrections[3].held);
  EXPECT_LT(AngleDeg(refined->cameras[3].rotation, before.cameras[3].rotation), 1e-9);
  std::erase_if(filmed.sights, [](const PointSight& s) { return s.point > 20; });
  const auto none = RefineRig(before, filmed.points_mm, filmed.sights, {});
  EXPECT_EQ(none.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("only 0 cameras have 200 sights"));
}

}  // namespace
}  // namespace weft
