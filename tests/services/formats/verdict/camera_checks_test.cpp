#include "services/formats/verdict/camera_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "services/formats/verdict/verdict.h"
#include "tests/services/formats/verdict/agreeing_cameras.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

v1::Verdict AgreementOf(const std::vector<CameraStanding>& cameras) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, "all is well", "");
  AddAgreementCheck(cameras, verdict);
  return verdict;
}

TEST(CameraChecks, CamerasThatAgreeAreGood) {
  const v1::Verdict verdict = AgreementOf(Agreeing(16));
  EXPECT_EQ(verdict.grade(), v1::GRADE_GOOD);
  ASSERT_EQ(verdict.checks_size(), 1);
  EXPECT_EQ(verdict.checks(0).value(), "100.0 %");
  EXPECT_EQ(AgreementOf({}).checks_size(), 0);
  // A camera that hardly saw anything is no reason.
  std::vector<CameraStanding> cameras = Agreeing(16);
  cameras[3].compared = 40, cameras[3].agreeing = 0;
  EXPECT_EQ(AgreementOf(cameras).grade(), v1::GRADE_GOOD);
}

TEST(CameraChecks, AnExchangedPairIsNamedWithItsRemedy) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  SetApart(cameras[3], "c07");
  SetApart(cameras[7], "c03");
  const v1::Verdict verdict = AgreementOf(cameras);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(
      verdict.reason(),
      "cameras c03 and c07 are exchanged: what each of them saw fits the place of the other, 0.2 px off "
      "there, 214 px at its own");
  EXPECT_THAT(verdict.remedy(), HasSubstr("`weft rig exchange RIG c03 c07 --out FILE`"));
  EXPECT_EQ(verdict.checks(0).value(), "87.5 %");
  EXPECT_EQ(AgreementOf({cameras.begin() + 3, cameras.begin() + 8}).grade(), v1::GRADE_BAD);
}

TEST(CameraChecks, RingsAndTwoPairsAreTold) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  SetApart(cameras[3], "c07");
  SetApart(cameras[7], "c11");
  SetApart(cameras[11], "c03");
  CameraFault fault = FaultOf(cameras);
  EXPECT_THAT(fault.reason,
              HasSubstr("cameras c03, c07 and c11 are exchanged: c03 saw what fits the place of c07, "
                        "c07 saw what fits the place of c11, c11"));
  EXPECT_THAT(fault.remedy, HasSubstr("weft rig exchange RIG c03 c07 c11 --out FILE"));
  cameras = Agreeing(16);
  SetApart(cameras[1], "c02");
  SetApart(cameras[2], "c01");
  SetApart(cameras[5], "c06");
  SetApart(cameras[6], "c05");
  fault = FaultOf(cameras);
  EXPECT_THAT(fault.reason, HasSubstr("cameras c01 and c02 are exchanged"));
  EXPECT_THAT(fault.reason, HasSubstr("cameras c05 and c06 are exchanged"));
}

TEST(CameraChecks, OthersAgreeWithNoOther) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  SetApart(cameras[4]);
  CameraFault fault = FaultOf(cameras);
  EXPECT_EQ(fault.reason,
            "camera c04 agrees with no other: it sees the cloth 214 px from where the others see it");
  EXPECT_FALSE(fault.is_named);
  EXPECT_EQ(AgreementOf(cameras).grade(), v1::GRADE_USABLE);
  cameras[4].frames = 10, cameras[4].frames_apart = 4, cameras[4].agreeing = 650;
  EXPECT_THAT(FaultOf(cameras).reason, HasSubstr("in 4 of 10 frames"));
  SetApart(cameras[5], "", "upside down");
  EXPECT_THAT(FaultOf(cameras).reason,
              HasSubstr("the images of camera c05 are upside down; camera c04 agrees"));
  // The place of a camera that is right.
  SetApart(cameras[5], "c09");
  EXPECT_THAT(FaultOf(cameras).reason, HasSubstr("camera c05 saw what fits the place of c09"));
  // A ring that others lead into.
  SetApart(cameras[4], "c05");
  SetApart(cameras[9], "c05");
  EXPECT_THAT(FaultOf(cameras).reason, HasSubstr("cameras c05 and c09 are exchanged"));
  EXPECT_THAT(FaultOf(cameras).reason, HasSubstr("camera c04 saw what fits the place of c05"));
  EXPECT_THAT(FaultOf(Agreeing(3)).reason, IsEmpty());
}

TEST(CameraChecks, APartThatWasExchangedIsNamed) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  SetApart(cameras[3], "c07");
  SetApart(cameras[7], "c03");
  cameras[3].fits_part = cameras[7].fits_part = "lens";
  CameraFault fault = FaultOf(cameras);
  EXPECT_THAT(fault.reason, HasSubstr("what each of them saw fits the lens of the other"));
  EXPECT_THAT(fault.remedy, HasSubstr("`weft rig exchange RIG c03 c07 --only lens --out FILE`"));
  cameras[3].fits_part = cameras[7].fits_part = "place-and-lens";
  fault = FaultOf(cameras);
  EXPECT_THAT(fault.reason, HasSubstr("fits the place and lens of the other"));
  EXPECT_THAT(fault.remedy, HasSubstr("--only place-and-lens"));
}

TEST(CameraChecks, ImagesOfEachOthersSizeCountAsApart) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  for (const auto& [one, other] : {std::pair(2, 9), std::pair(9, 2)}) {
    cameras[one].compared = cameras[one].agreeing = 0;
    cameras[one].has_other_size = true, cameras[one].fits_camera = cameras[other].camera;
  }
  const v1::Verdict verdict = AgreementOf(cameras);
  EXPECT_EQ(verdict.reason(), "cameras c02 and c09 are exchanged: their images have each other's size");
  EXPECT_THAT(verdict.remedy(), HasSubstr("`weft rig exchange RIG c02 c09 --out FILE`"));
  EXPECT_EQ(verdict.checks(0).value(), "87.5 %");
}

TEST(CameraChecks, ACameraThatSeesNothingOfWhatFacesItIsNamed) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  for (CameraStanding& camera : cameras) camera.in_view = 2000, camera.seen = 1600;
  const auto judge = [&] {
    v1::Verdict verdict;
    AddFinding(verdict, v1::GRADE_GOOD, "all is well", "");
    AddSightCheck(cameras, verdict);
    return verdict;
  };
  EXPECT_EQ(judge().grade(), v1::GRADE_GOOD);
  cameras[4].seen = 700;  // much is hidden from it
  EXPECT_EQ(judge().grade(), v1::GRADE_GOOD);
  cameras[4].seen = 0;
  EXPECT_EQ(judge().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(
      judge().reason(),
      "camera c04 sees nothing of the cloth that faces it: 0 of 2000 cells, where most cameras see 80 %");
  cameras[5].seen = 40;
  EXPECT_THAT(judge().reason(),
              HasSubstr("cameras c04 and c05 see little of the cloth that faces them: 40 of"));
  // One that agrees with no other has a check of its own; one that nothing faces is not judged.
  SetApart(cameras[5]);
  EXPECT_THAT(judge().reason(), HasSubstr("camera c04 sees nothing"));
  cameras[4].in_view = 50;
  EXPECT_EQ(judge().grade(), v1::GRADE_GOOD);
  v1::Verdict none;
  AddSightCheck(Agreeing(16), none);
  EXPECT_EQ(none.checks_size(), 0);
}

TEST(CameraChecks, ACameraThatRepeatsItsPictureIsNamed) {
  std::vector<CameraStanding> cameras = Agreeing(16);
  for (CameraStanding& camera : cameras) camera.images = 11;
  v1::Verdict good;
  AddRepeatCheck(cameras, good);
  EXPECT_EQ(good.checks(0).grade(), v1::GRADE_GOOD);
  cameras[6].repeated = 11;
  v1::Verdict verdict;
  AddRepeatCheck(cameras, verdict);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(verdict.reason(),
            "camera c06 stood still: in 11 of 11 images it sent the picture of the frame before");
  for (CameraStanding& camera : cameras) camera.repeated = 11;
  v1::Verdict bad;
  AddRepeatCheck(cameras, bad);
  EXPECT_EQ(bad.grade(), v1::GRADE_BAD);
}

v1::Verdict ScaleOf(const CameraFacts& facts) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, "all is well", "");
  AddScaleCheck(facts, verdict);
  return verdict;
}

TEST(CameraChecks, TheSizeOfTheClothIsAReason) {
  CameraFacts facts{.cameras = Agreeing(16), .print_scale = 1.012, .template_scale = 1.01};
  EXPECT_EQ(ScaleOf(facts).grade(), v1::GRADE_GOOD);
  facts.print_scale = facts.template_scale = 1.05;
  EXPECT_EQ(ScaleOf(facts).grade(), v1::GRADE_USABLE);
  EXPECT_THAT(ScaleOf(facts).reason(),
              HasSubstr("its cells lie 1.05 times as far apart as they are printed"));
  EXPECT_THAT(ScaleOf(facts).reason(), HasSubstr("the rig has another scale"));
  facts.template_scale = 1;
  EXPECT_THAT(ScaleOf(facts).reason(), HasSubstr("it fits the template, so cell_mm"));
  facts.print_scale = 0.1, facts.template_scale = 0.1;  // centimetres
  EXPECT_EQ(ScaleOf(facts).grade(), v1::GRADE_BAD);
  facts.print_scale.reset();  // a board of which only the picture is known
  EXPECT_THAT(ScaleOf(facts).reason(), HasSubstr("0.1 times as far apart as on the template"));
  facts.template_scale.reset();
  EXPECT_EQ(ScaleOf(facts).checks_size(), 0);
}

TEST(CameraChecks, LensesOfAllCamerasAreToldFromOneAndFromTheScale) {
  CameraFacts facts{.cameras = Agreeing(16), .print_scale = 1.05, .template_scale = 1.05};
  for (CameraStanding& camera : facts.cameras) camera.perspective = -0.05, camera.perspective_sigma = 0.004;
  v1::Verdict verdict = ScaleOf(facts);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("the lenses of the rig are not those of the recording"));
  EXPECT_THAT(verdict.reason(), HasSubstr("focal lengths are about 5 % too short; its cells lie 1.05 times"));
  // The check of the lenses fails alone where the size is right.
  facts.print_scale = facts.template_scale = 1;
  verdict = ScaleOf(facts);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("too short; its cells lie 1 times"));
  // One camera does not say it of all.
  facts.cameras = Agreeing(16);
  facts.cameras[5].perspective = -0.1, facts.cameras[5].perspective_sigma = 0.004;
  EXPECT_EQ(ScaleOf(facts).grade(), v1::GRADE_GOOD);
  facts.cameras = Agreeing(16);
  facts.cameras[5].scale = 1.05;
  verdict = ScaleOf(facts);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(verdict.reason(),
            "camera c05 sees the cloth 5.0 % too large: its focal length (zoom) or its distance is off");
  EXPECT_THAT(verdict.reason(), Not(HasSubstr("lenses")));
}

TEST(CameraChecks, CamerasThatTheRigLacksCount) {
  CameraFacts facts{.unknown = {"c10", "c11", "c12", "c13", "c14", "c15"}, .of_rig = 10};
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, "all is well", "");
  AddKnownCheck(facts, verdict);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(verdict.reason(),
            "6 of 16 cameras of the recording are not in the rig, their images were not used: "
            "c10, c11, c12, c13, c14 and c15");
  EXPECT_EQ(verdict.checks(0).value(), "62.5 %");
  facts.of_rig = 4;
  v1::Verdict bad;
  AddKnownCheck(facts, bad);
  EXPECT_EQ(bad.grade(), v1::GRADE_BAD);
}

TEST(CameraChecks, ExchangesOfPartOfTheFramesAreTold) {
  std::vector<CameraStanding> cameras = Agreeing(8);
  SetApart(cameras[1], "c02");
  SetApart(cameras[2], "c01");
  SetApart(cameras[5], "c06");
  SetApart(cameras[6], "c05");
  for (const size_t c : {1, 2}) cameras[c].frames = 8, cameras[c].frames_apart = 4;
  const CameraFault fault = FaultOf(cameras);
  EXPECT_TRUE(fault.is_named);
  EXPECT_THAT(fault.reason, HasSubstr("cameras c01 and c02 are exchanged in 4 of 8 frames: what each"));
  EXPECT_EQ(fault.remedy,
            "Register these frames apart (--frames), with the rig of `weft rig exchange RIG c01 c02 --out "
            "FILE1`; Exchange the cables, or the cameras of the rig with `weft rig exchange FILE1 c05 c06 "
            "--out FILE2`. Then register again.");
  cameras = Agreeing(8);
  SetApart(cameras[3], "c07");
  cameras[3].fits_part = "lens";
  EXPECT_EQ(FaultOf(cameras).reason, "camera c03 saw what fits the lens of c07");
  EXPECT_EQ(FaultOf(cameras).remedy, "See which images are those of c03 and of c07. Then register again.");
  cameras[3].fits_part = "camera";
  EXPECT_EQ(FaultOf(cameras).reason, "camera c03 saw what fits the place of c07, where c07 stands");
  cameras = Agreeing(8);
  for (size_t c = 0; c < 8; ++c) SetApart(cameras[c]), cameras[c].median_px = 10.0 * static_cast<double>(c);
  EXPECT_EQ(
      FaultOf(cameras).reason,
      "cameras c00, c01, c02, c03, c04, c05 and 2 more agree with no other: they see the cloth 70 px from "
      "where the others see it");
  // Four fifths of what is compared.
  cameras = Agreeing(1);
  cameras[0].agreeing = 800;
  EXPECT_FALSE(IsApart(cameras[0]));
  cameras[0].agreeing = 799;
  EXPECT_TRUE(IsApart(cameras[0]));
  cameras[0].compared = 50, cameras[0].agreeing = 0;
  EXPECT_TRUE(IsApart(cameras[0]));
  cameras[0].compared = 49;
  EXPECT_FALSE(IsApart(cameras[0]));
}

TEST(CameraChecks, TheRigKnowsAllOrOneIsMissing) {
  v1::Verdict none, all, one;
  AddKnownCheck({}, none);
  EXPECT_EQ(none.checks_size(), 0);
  AddKnownCheck({.of_rig = 3}, all);
  EXPECT_EQ(all.grade(), v1::GRADE_GOOD);
  EXPECT_EQ(all.checks(0).value(), "100.0 %");
  AddKnownCheck({.unknown = {"top"}, .of_rig = 3}, one);
  EXPECT_EQ(one.reason(),
            "1 of 4 cameras of the recording is not in the rig, their images were not used: top");
}

// By how much a lens is off where its camera is the only one: half a percent, and five sigmas.
TEST(CameraChecks, ALensIsOffByHalfAPercentAndFiveSigmas) {
  const auto is_told = [](double scale, double sigma) {
    CameraFacts facts{.cameras = Agreeing(8)};
    facts.cameras[2].scale = scale, facts.cameras[2].scale_sigma = sigma;
    return ScaleOf(facts).grade() == v1::GRADE_USABLE;
  };
  EXPECT_FALSE(is_told(1.0049, 1e-4));
  EXPECT_TRUE(is_told(1.0051, 1e-4));
  EXPECT_TRUE(is_told(0.9949, 1e-4));
  EXPECT_FALSE(is_told(1.01, 0.0021));
  EXPECT_TRUE(is_told(1.01, 0.0019));
  CameraFacts two{.cameras = Agreeing(8)};
  two.cameras[2].scale = 1.02, two.cameras[5].scale = 0.97;
  EXPECT_EQ(ScaleOf(two).reason(),
            "camera c05 sees the cloth 3.0 % too small: its focal length (zoom) or its distance is off");
  // Long lenses, of all.
  CameraFacts all{.cameras = Agreeing(8)};
  for (CameraStanding& camera : all.cameras) camera.perspective = 0.05;
  EXPECT_EQ(ScaleOf(all).reason(),
            "the lenses of the rig are not those of the recording: by the perspective of the cloth the focal "
            "lengths are about 5 % too long");
  // Three cameras tell, two do not.
  all.cameras.resize(3);
  EXPECT_EQ(ScaleOf(all).grade(), v1::GRADE_USABLE);
  all.cameras.resize(2);
  EXPECT_EQ(ScaleOf(all).checks_size(), 0);
}

}  // namespace
}  // namespace weft
