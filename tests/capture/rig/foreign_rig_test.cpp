#include "capture/rig/foreign_rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Cameras on a ring of 2 m around a stage, at two heights, each turned a little off the middle.
Rig Studio(double arc_deg = 360) {
  Rig rig;
  for (int i = 0; i < 12; ++i) {
    const double angle = arc_deg * i / 12 * std::numbers::pi / 180;
    CameraModel camera;
    camera.id = absl::StrCat("c", i);
    camera.width_px = 1000;
    camera.height_px = 1200;
    camera.fx_px = camera.fy_px = 1500;
    camera.cx_px = 480;
    camera.cy_px = 610;
    const Eigen::Vector3d center(2000 * std::sin(angle) + 300, -400.0 * (i % 2),
                                 -2000 * std::cos(angle) + 900);
    const Eigen::Vector3d forward = (Eigen::Vector3d(300 + 30 * (i % 3), 100, 900) - center).normalized();
    const Eigen::Vector3d right = Eigen::Vector3d(0, 1, 0).cross(forward).normalized();
    camera.rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    camera.translation_mm = -camera.rotation * center;
    rig.cameras.push_back(camera);
  }
  return rig;
}

std::string Judged(const Rig& rig, ForeignRig* out = nullptr) {
  EXPECT_TRUE(rig.Validate().ok());
  ForeignRig foreign{rig, {}};
  const absl::Status status = JudgeRig({}, &foreign);
  if (out) *out = foreign;
  return std::string(status.message());
}

void Invert(CameraModel& camera) {
  camera.translation_mm = camera.CenterWorld();
  camera.rotation.transposeInPlace();
}

TEST(JudgeRig, StudiosHaveNoRemark) {
  for (const double arc_deg : {360.0, 180.0, 60.0}) {
    ForeignRig foreign;
    EXPECT_EQ(Judged(Studio(arc_deg), &foreign), "") << arc_deg;
    EXPECT_THAT(foreign.remarks, IsEmpty());
  }
}

TEST(JudgeRig, PosesOfTheCameraInTheWorldAreNamed) {
  for (const double arc_deg : {360.0, 180.0}) {
    Rig rig = Studio(arc_deg);
    for (CameraModel& camera : rig.cameras) Invert(camera);
    EXPECT_THAT(Judged(rig), HasSubstr("--poses world_from_camera")) << arc_deg;
    ApplyConvention({.world_from_camera = true}, &rig);
    EXPECT_EQ(Judged(rig), "");
    EXPECT_LT((rig.cameras[3].CenterWorld() - Studio(arc_deg).cameras[3].CenterWorld()).norm(), 1e-9);
  }
}

TEST(JudgeRig, OpenGlsAxesAreNamed) {
  Rig rig = Studio();
  for (CameraModel& camera : rig.cameras) {
    const Eigen::Vector3d turn(1, -1, -1);
    camera.rotation = turn.asDiagonal() * camera.rotation;
    camera.translation_mm = turn.asDiagonal() * camera.translation_mm;
  }
  EXPECT_THAT(Judged(rig), HasSubstr("OpenGL"));
  ForeignRig as_told{rig, {}};
  EXPECT_TRUE(JudgeRig({.judge_poses = false}, &as_told).ok());
}

TEST(JudgeRig, CamerasThatLookInOneDirectionAreARig) {
  Rig rig = Studio();
  for (CameraModel& camera : rig.cameras) {
    const Eigen::Vector3d center = camera.CenterWorld();
    camera.rotation.setIdentity();
    camera.translation_mm = -center;
  }
  EXPECT_EQ(Judged(rig), "");
}

TEST(JudgeRig, ARigSmallerThanACameraIsInAnotherUnit) {
  Rig rig = Studio();
  ApplyConvention({.mm_per_unit = 1e-3}, &rig);
  EXPECT_THAT(Judged(rig), HasSubstr("--mm-per-unit"));
  ForeignRig as_told{rig, {}};
  EXPECT_TRUE(JudgeRig({.judge_unit = false}, &as_told).ok());
  ApplyConvention({.mm_per_unit = 1000}, &rig);
  EXPECT_EQ(Judged(rig), "");
  for (CameraModel& camera : rig.cameras) camera.rotation.setIdentity(), camera.translation_mm.setZero();
  ForeignRig without_poses;
  EXPECT_EQ(Judged(rig, &without_poses), "");
  ASSERT_THAT(without_poses.remarks, SizeIs(1));
  EXPECT_THAT(without_poses.remarks[0], HasSubstr("has the file no poses?"));
}

TEST(JudgeRig, PrincipalPointsBelongToTheSizeOfTheImage) {
  Rig rig = Studio();
  rig.cameras[4].width_px = 400;
  EXPECT_THAT(Judged(rig), HasSubstr("camera c4: the principal point 480.0, 610.0 is outside"));
  rig = Studio();
  for (CameraModel& camera : rig.cameras) camera.width_px = 2000, camera.height_px = 2400;
  ForeignRig foreign;
  EXPECT_EQ(Judged(rig, &foreign), "");
  ASSERT_THAT(foreign.remarks, SizeIs(1));
  EXPECT_THAT(foreign.remarks[0], HasSubstr("24 % of the width and 25 % of the height"));
}

TEST(JudgeRig, SmallUnitsOfAStudioAreSaid) {
  for (const double mm : {10.0, 25.4}) {  // cm and inches, taken as mm
    Rig rig = Studio();
    ApplyConvention({.mm_per_unit = 1 / mm}, &rig);
    ForeignRig foreign;
    EXPECT_EQ(Judged(rig, &foreign), "");
    ASSERT_THAT(foreign.remarks, SizeIs(1)) << mm;
    EXPECT_THAT(foreign.remarks[0], HasSubstr("fill their images: if lengths are in another unit"));
    ForeignRig as_told{rig, {}};
    EXPECT_TRUE(JudgeRig({.judge_unit = false}, &as_told).ok());
    EXPECT_THAT(as_told.remarks, IsEmpty());
  }
  Rig large = Studio();
  ApplyConvention({.mm_per_unit = 1000}, &large);
  ForeignRig foreign;
  EXPECT_EQ(Judged(large, &foreign), "");
  EXPECT_THAT(foreign.remarks, SizeIs(1));
}

}  // namespace
}  // namespace weft
