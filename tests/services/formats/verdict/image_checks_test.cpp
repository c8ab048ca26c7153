// The checks of what single images show.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "services/formats/verdict/camera_checks.h"
#include "services/formats/verdict/verdict.h"
#include "tests/services/formats/verdict/agreeing_cameras.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::Verdict BlankOf(const std::vector<CameraStanding>& cameras) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, "all is well", "");
  AddBlankCheck(cameras, verdict);
  return verdict;
}

TEST(ImageChecks, SingleImagesThatShowNothingAreCounted) {
  std::vector<CameraStanding> cameras = Agreeing(4);
  for (CameraStanding& camera : cameras) camera.in_view = 2000, camera.seen = 1600, camera.facing_images = 10;
  EXPECT_EQ(BlankOf(cameras).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(BlankOf(cameras).checks(0).value(), "100.0 %");
  cameras[2].blank_images = 1, cameras[2].blank_frame = "0007";
  EXPECT_EQ(BlankOf(cameras).grade(), v1::GRADE_USABLE);
  EXPECT_EQ(BlankOf(cameras).reason(),
            "1 of 40 images shows nothing of the cloth that faces its camera: camera c02 in frame 0007");
  EXPECT_EQ(BlankOf(cameras).checks(0).value(), "97.5 %");
  cameras[1].blank_images = 3, cameras[1].blank_frame = "0004";
  EXPECT_EQ(BlankOf(cameras).reason(),
            "4 of 40 images show nothing of the cloth that faces its camera: cameras c01 in frame 0004 and 2 "
            "more and c02 in frame 0007");
  // Those that agree with no other, and those that never see it, have checks of their own.
  SetApart(cameras[1]);
  EXPECT_THAT(BlankOf(cameras).reason(), HasSubstr("1 of 30 images shows"));
  cameras[2].seen = 0;
  EXPECT_EQ(BlankOf(cameras).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(BlankOf(cameras).checks_size(), 1);
  for (CameraStanding& camera : cameras) camera.facing_images = 0;
  EXPECT_EQ(BlankOf(cameras).checks_size(), 0);
  EXPECT_EQ(BlankOf(Agreeing(4)).checks_size(), 0) << "no mesh tells";
}

TEST(ImageChecks, AHundredVerticesInViewTellOfACamera) {
  std::vector<CameraStanding> cameras = Agreeing(3);
  for (CameraStanding& camera : cameras) camera.in_view = 100, camera.seen = 50;
  cameras[1].in_view = 99, cameras[1].seen = 0;
  v1::Verdict few;
  AddSightCheck(cameras, few);
  EXPECT_EQ(few.checks(0).value(), "100.0 %");
  cameras[1].in_view = 100;
  v1::Verdict enough;
  AddSightCheck(cameras, enough);
  EXPECT_EQ(enough.checks(0).value(), "66.7 %");
  // A fifth of what is usual.
  cameras[1].seen = 10;
  v1::Verdict little;
  AddSightCheck(cameras, little);
  EXPECT_EQ(little.checks(0).value(), "100.0 %");
  cameras[1].seen = 9;
  v1::Verdict less;
  AddSightCheck(cameras, less);
  EXPECT_THAT(less.reason(), HasSubstr("camera c01 sees little of the cloth that faces it: 9 of 100 cells"));
}

v1::Verdict OffsetOf(const std::vector<CameraStanding>& cameras) {
  v1::Verdict verdict;
  AddOffsetCheck(cameras, verdict);
  return verdict;
}

TEST(ImageChecks, TheOffsetIsThatOfMostCameras) {
  std::vector<CameraStanding> cameras = Agreeing(3);
  for (CameraStanding& camera : cameras) camera.common_px = 0.05;
  ASSERT_EQ(OffsetOf(cameras).checks_size(), 1);
  EXPECT_EQ(OffsetOf(cameras).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(OffsetOf(cameras).checks(0).value(), "0.05 px");
  cameras[0].common_px = cameras[2].common_px = 0.31;
  EXPECT_EQ(OffsetOf(cameras).grade(), v1::GRADE_USABLE);
  EXPECT_EQ(OffsetOf(cameras).reason(),
            "most cameras see whole regions of the cloth 0.31 px from where the others see them: images of "
            "several cameras are of another moment, or the calibration is off");
  // Two do not tell, nor do those that agree with no other or were hardly compared.
  EXPECT_EQ(OffsetOf(Agreeing(2)).checks_size(), 0);
  SetApart(cameras[1]);
  EXPECT_EQ(OffsetOf(cameras).checks_size(), 0);
  cameras = Agreeing(3);
  cameras[1].compared = 49;
  EXPECT_EQ(OffsetOf(cameras).checks_size(), 0);
  cameras[1].compared = cameras[1].agreeing = 50;
  EXPECT_EQ(OffsetOf(cameras).checks_size(), 1);
}

TEST(ImageChecks, RepeatedPicturesAreThoseOfTheCamerasThatRepeatThem) {
  std::vector<CameraStanding> cameras = Agreeing(4);
  for (CameraStanding& camera : cameras) camera.images = 10;
  cameras[1].repeated = 2, cameras[3].repeated = 1;
  v1::Verdict verdict;
  AddRepeatCheck(cameras, verdict);
  EXPECT_EQ(verdict.reason(),
            "cameras c01 and c03 stood still: in 3 of 20 images they sent the picture of the frame before");
  EXPECT_EQ(verdict.checks(0).value(), "92.5 %");
  v1::Verdict none;
  AddRepeatCheck(Agreeing(4), none);
  EXPECT_EQ(none.checks_size(), 0) << "single frames";
}

}  // namespace
}  // namespace weft
