// The words and grades of calibrations and refinements, of results made by hand.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <limits>

#include "services/formats/files/json_file.h"
#include "services/studio/calibration/calibrate_dump.h"
#include "services/studio/calibration/refine_rig.h"
#include "weft/v1/calibration.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Two cameras, three frames, one board.
CalibrationResult Solved(double rms_px, double left_sigma_px, double right_sigma_px) {
  CalibrationResult result;
  result.detection.views.cameras = {{"left", 300, 300}, {"right", 300, 300}};
  result.detection.views.frames = {"0000", "0001", "0002"};
  result.detection.sightings.resize(2);
  result.solution.emplace();
  result.solution->rms_px = rms_px;
  result.solution->cameras.resize(2);
  result.solution->cameras[0].projection_sigma_px = left_sigma_px;
  result.solution->cameras[1].projection_sigma_px = right_sigma_px;
  return result;
}

TEST(CalibrationVerdict, TheWorstCameraIsTheLeastCertainOne) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(WorstCameraOf(Solved(0.1, 0.1, 0.2)).id, "right");
  EXPECT_EQ(WorstCameraOf(Solved(0.1, 0.1, 0.2)).sigma_px, 0.2);
  EXPECT_EQ(WorstCameraOf(Solved(0.1, 0.2, 0.2)).id, "left");
  EXPECT_EQ(WorstCameraOf(Solved(0.1, kNone, 0)).id, "right");
  EXPECT_EQ(WorstCameraOf(Solved(0.1, 0.1, kNone)).id, "left");
  EXPECT_EQ(WorstCameraOf(Solved(0.1, kNone, kNone)).id, "");
}

TEST(CalibrationVerdict, OfASolutionIsThatOfItsErrors) {
  const v1::Verdict good = CalibrationVerdict(Solved(0.25, 0.1, 0.05));
  EXPECT_EQ(good.grade(), v1::GRADE_GOOD);
  EXPECT_EQ(
      good.reason(),
      "2 cameras from 3 frames: reprojection error 0.250 px; projection uncertainty up to 0.100 px (left)");
  EXPECT_EQ(good.checks_size(), 2);
  const v1::Verdict unsure = CalibrationVerdict(Solved(0.25, 0.1, 0.3));
  EXPECT_EQ(unsure.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(unsure.reason(), "camera right sees a known point of the stage to 0.300 px only");
  EXPECT_EQ(CalibrationVerdict(Solved(1.5, 0.1, 0.1)).grade(), v1::GRADE_BAD);
}

TEST(CalibrationVerdict, OfARefusalHasCauseAndRemedyOfTheFirstIssue) {
  CalibrationResult result = Solved(0.1, 0.1, 0.1);
  result.issues.push_back(
      {CalibrationFault::kBlurred, {1}, "camera right: its images are blurred; focus it"});
  EXPECT_EQ(CalibrationHeadline(result), "Calibration refused for 1 reason");
  v1::Verdict verdict = CalibrationVerdict(result);
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_EQ(verdict.reason(), "camera right: its images are blurred");
  EXPECT_EQ(verdict.remedy(), "Focus it.");
  EXPECT_EQ(verdict.checks_size(), 0);
  result.issues[0].message = "half; dark; is there light?";
  EXPECT_EQ(CalibrationVerdict(result).reason(), "half; dark");
  EXPECT_EQ(CalibrationVerdict(result).remedy(), "Is there light?");
  result.issues.push_back({CalibrationFault::kUncertain, {}, "no"});
  EXPECT_EQ(CalibrationHeadline(result), "Calibration refused for 2 reasons");
  EXPECT_EQ(CalibrationVerdict(result).remedy(), "Is there light? The other causes follow.");
  result.issues.erase(result.issues.begin());
  EXPECT_EQ(CalibrationVerdict(result).reason(), "no");
  EXPECT_EQ(CalibrationVerdict(result).remedy(), "Fix that and calibrate again.");
}

v1::CalibrationReport ReportOf(const CalibrationResult& result) {
  v1::CalibrationReport report;
  const auto text = ToJson(CalibrationMessage(result));
  EXPECT_TRUE(text.ok()) << text.status();
  EXPECT_TRUE(ParseJson(text.value_or("{}"), "report", report).ok());
  return report;
}

TEST(CalibrationJson, HasEveryNumberOfASolution) {
  CalibrationResult result = Solved(0.25, 0.1, std::numeric_limits<double>::quiet_NaN());
  result.detection_s = 1.5;
  result.solution_s = 2.5;
  result.detection.sightings[0] = {
      .images = 5, .tags = 9, .blurred_tags = 2, .small_tags = 3, .unclear_tags = 4};
  // Both cameras see the board in frame 0; the right one in frame 1 too.
  for (const auto& [camera, frame] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{1, 1}}) {
    BoardView view;
    view.camera = camera;
    view.frame = frame;
    result.detection.views.boards.push_back(view);
  }
  CalibrationSolution& solution = *result.solution;
  solution.cameras[0].corners = 40;
  solution.cameras[0].rejected_corners = 6;
  solution.cameras[0].sigma_px = 0.03;
  solution.cameras[0].rms_px = 0.04;
  solution.variance_factor = 1.25;
  solution.bundle.boards.resize(1);
  solution.bundle.boards[0].id = "A";
  solution.bundle.warps = {{.bend_xx_mm = 1, .bend_xy_mm = 2, .bend_yy_mm = 3, .stretch = 0.5}};
  result.target.scale_bars.resize(2);
  result.target.scale_bars[1].id = "bar";
  result.target.scale_bars[1].length_mm = 500;
  solution.bars = {{.bar = 1, .frames = 7, .length_mm = 499.5, .sigma_mm = 0.25}};

  const v1::CalibrationReport report = ReportOf(result);
  EXPECT_TRUE(report.accepted());
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(report.frames(), 3);
  EXPECT_EQ(report.rms_px(), 0.25);
  EXPECT_EQ(report.variance_factor(), 1.25);
  EXPECT_EQ(report.detection_s(), 1.5);
  EXPECT_EQ(report.solution_s(), 2.5);
  EXPECT_EQ(report.rig_hash(), result.rig.ContentHash());
  ASSERT_EQ(report.cameras_size(), 2);
  const v1::CalibrationReport::Camera& left = report.cameras(0);
  EXPECT_EQ(left.id(), "left");
  EXPECT_EQ(left.images(), 5);
  EXPECT_EQ(left.blurred_tags(), 2);
  EXPECT_EQ(left.views(), 1);
  EXPECT_EQ(left.shared_views(), 1);
  EXPECT_EQ(left.coverage_size(), 9);
  EXPECT_EQ(left.corners(), 40);
  EXPECT_EQ(left.rejected_corners(), 6);
  EXPECT_EQ(left.corner_sigma_px(), 0.03);
  EXPECT_EQ(left.rms_px(), 0.04);
  EXPECT_EQ(left.projection_sigma_px(), 0.1);
  EXPECT_EQ(report.cameras(1).views(), 2);
  EXPECT_EQ(report.cameras(1).shared_views(), 1);
  EXPECT_EQ(report.cameras(1).projection_sigma_px(), 0);
  ASSERT_EQ(report.warps_size(), 1);
  EXPECT_EQ(report.warps(0).board(), "A");
  EXPECT_EQ(report.warps(0).bend_xx_mm(), 1);
  EXPECT_EQ(report.warps(0).bend_xy_mm(), 2);
  EXPECT_EQ(report.warps(0).bend_yy_mm(), 3);
  EXPECT_EQ(report.warps(0).stretch(), 0.5);
  ASSERT_EQ(report.bars_size(), 1);
  EXPECT_EQ(report.bars(0).id(), "bar");
  EXPECT_EQ(report.bars(0).length_mm(), 500);
  EXPECT_EQ(report.bars(0).measured_mm(), 499.5);
  EXPECT_EQ(report.bars(0).sigma_mm(), 0.25);
  EXPECT_EQ(report.bars(0).frames(), 7);
}

TEST(CalibrationJson, OfARefusalNamesTheCamerasOfEachIssue) {
  CalibrationResult result = Solved(0, 0, 0);
  result.solution.reset();
  result.issues.push_back({CalibrationFault::kBlurred, {1, 0}, "blurred; focus"});
  const v1::CalibrationReport report = ReportOf(result);
  EXPECT_FALSE(report.accepted());
  ASSERT_EQ(report.issues_size(), 1);
  EXPECT_EQ(report.issues(0).fault(), CalibrationFaultName(CalibrationFault::kBlurred));
  EXPECT_THAT(report.issues(0).cameras(), ElementsAre("right", "left"));
  EXPECT_EQ(report.issues(0).message(), "blurred; focus");
  EXPECT_EQ(report.rig_hash(), "");
}

// Three cameras of 100 sights each, 0.1 px off.
RefinementResult Refined() {
  RefinementResult result;
  for (const char* id : {"a", "b", "c"}) {
    result.before.cameras.emplace_back().id = id;
    CameraCorrection& correction = result.refined.corrections.emplace_back();
    correction.sights = 100;
    correction.after_rms_px = 0.1;
    correction.after_median_px = 0.08;
    result.standings.emplace_back().camera = id;
  }
  result.refined.converged = true;
  return result;
}

TEST(RefinementVerdict, CountsCamerasThatMoved) {
  RefinementResult result = Refined();
  EXPECT_EQ(RefinementVerdict(result).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(RefinementVerdict(result).reason(), "no camera moved");
  EXPECT_DOUBLE_EQ(RmsAfterPx(result), 0.1);
  result.refined.corrections[0].moved = true;
  EXPECT_EQ(RefinementVerdict(result).reason(), "1 camera moved and was corrected");
  result.refined.corrections[2].moved = true;
  EXPECT_EQ(RefinementVerdict(result).reason(), "2 cameras moved and were corrected");
}

TEST(RefinementVerdict, TheErrorIsThatOfAllSightsButMisfits) {
  RefinementResult result = Refined();
  result.refined.corrections[0].sights = 300;
  result.refined.corrections[0].after_rms_px = 0.5;
  result.refined.corrections[2].misfit = true;
  result.refined.corrections[2].after_rms_px = 50;
  EXPECT_DOUBLE_EQ(RmsAfterPx(result), std::sqrt((300 * 0.25 + 100 * 0.01) / 400));
  result.refined.corrections[2].misfit = false;
  EXPECT_EQ(RefinementVerdict(result).grade(), v1::GRADE_BAD);
}

TEST(RefinementVerdict, AMisfitIsNamedWithWhatOthersHave) {
  RefinementResult result = Refined();
  CameraCorrection& correction = result.refined.corrections[1];
  correction.held = correction.misfit = true;
  correction.after_median_px = 7.5;
  const v1::Verdict verdict = RefinementVerdict(result);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(verdict.reason(),
            "no pose of camera b explains its images: they stay 7.5 px off, those of most cameras 0.08 px");
}

TEST(RefinementVerdict, CamerasThatSeeTooLittleAreCounted) {
  RefinementResult result = Refined();
  result.refined.corrections[1].held = true;
  EXPECT_EQ(RefinementVerdict(result).grade(), v1::GRADE_USABLE);
  EXPECT_EQ(RefinementVerdict(result).reason(),
            "1 camera sees too little of the cloth and was not evaluated");
  result.refined.corrections[2].held = true;
  EXPECT_EQ(RefinementVerdict(result).reason(),
            "2 cameras see too little of the cloth and were not evaluated");
}

TEST(RefinementVerdict, PosesThatDidNotSettleAreNotWrittenWhereCamerasMoved) {
  RefinementResult result = Refined();
  result.refined.converged = false;
  EXPECT_EQ(RefinementVerdict(result).grade(), v1::GRADE_USABLE);
  EXPECT_THAT(RefinementVerdict(result).remedy(), HasSubstr("--samples"));
  result.refined.corrections[0].moved = true;
  EXPECT_EQ(RefinementVerdict(result).grade(), v1::GRADE_BAD);
  EXPECT_EQ(RefinementVerdict(result).reason(), "the poses did not settle");
}

// Every number of the report, in fractions that text keeps.
TEST(RefinementReport, HasEveryNumberOfEachCamera) {
  RefinementResult result = Refined();
  result.frames = {"0000", "0007"};
  result.refined.points_mm.resize(5);
  result.refined.corrections[0] = {.sights = 12,
                                   .held = true,
                                   .misfit = true,
                                   .moved = true,
                                   .rotation_deg = 0.25,
                                   .rotation_sigma_deg = 0.5,
                                   .center_mm = 1.25,
                                   .center_sigma_mm = 1.5,
                                   .shift_px = 2.25,
                                   .before_rms_px = 3.5,
                                   .after_rms_px = 4.25,
                                   .after_median_px = 5.5};
  result.refined.corrections[2].moved = true;
  result.rig.cameras = result.before.cameras;
  result.rig.cameras[0].fx_px = 5;
  v1::RigRefinementReport report = RefinementReport(result);
  EXPECT_EQ(report.verdict().DebugString(), RefinementVerdict(result).DebugString());
  EXPECT_EQ(report.rig_hash_before(), result.before.ContentHash());
  EXPECT_EQ(report.rig_hash(), result.rig.ContentHash());
  EXPECT_NE(report.rig_hash(), report.rig_hash_before());
  report.clear_verdict(), report.clear_rig_hash(), report.clear_rig_hash_before();
  v1::RigRefinementReport expected;
  ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(
      R"(cameras { id: "a" sights: 12 held: true misfit: true moved: true rotation_deg: 0.25
                   rotation_sigma_deg: 0.5 center_mm: 1.25 center_sigma_mm: 1.5 shift_px: 2.25
                   before_rms_px: 3.5 after_rms_px: 4.25 after_median_px: 5.5 }
         cameras { id: "b" sights: 100 after_rms_px: 0.1 after_median_px: 0.08 }
         cameras { id: "c" sights: 100 moved: true after_rms_px: 0.1 after_median_px: 0.08 }
         frames: 2 points: 5 converged: true written: true)",
      &expected));
  EXPECT_EQ(report.DebugString(), expected.DebugString());
}

TEST(RefinementText, HasALineForEachCameraThatMovedOrStayed) {
  RefinementResult result = Refined();
  for (const char* id : {"d", "e"}) {
    result.before.cameras.emplace_back().id = id;
    result.refined.corrections.push_back(result.refined.corrections[0]);
    result.standings.emplace_back().camera = id;
  }
  result.rig.cameras = result.before.cameras;
  result.frames = {"0000", "0007"};
  result.refined.points_mm.resize(5);
  for (CameraCorrection& correction : result.refined.corrections) correction.before_rms_px = 0.5;
  EXPECT_THAT(RefinementText(result),
              ElementsAre("no camera moved",
                          "5 points of 2 frames: reprojection error 0.500 px before, 0.100 px now"));
  CameraCorrection& moved = result.refined.corrections[0];
  moved.moved = true;
  moved.rotation_deg = 0.05, moved.rotation_sigma_deg = 0.001, moved.center_mm = 1.25,
  moved.center_sigma_mm = 0.5, moved.shift_px = 2.5, moved.before_rms_px = 2;
  result.refined.corrections[1].held = result.refined.corrections[1].misfit = true;
  result.refined.corrections[1].before_rms_px = 50;
  result.refined.corrections[2].held = true;
  result.standings[2].compared = 100;
  result.refined.corrections[3].held = true;
  result.refined.corrections[3].sights = 0;
  // Of the sights of all cameras but the misfit: sqrt((4 + 2 * 0.25) / 3).
  EXPECT_THAT(
      RefinementText(result),
      ElementsAre("camera a moved: turned by 0.0500 deg (sigma 0.0010), centre by 1.25 mm (sigma 0.50); "
                  "it saw the cloth 2.50 px off",
                  "camera b: no pose puts it right, it stays as it was",
                  "camera c: takes no part, it stays as it was",
                  "camera d: only 0 sights of the cloth, it stays as it was",
                  "5 points of 2 frames: reprojection error 1.225 px before, 0.100 px now"));
}

TEST(RefinementVerdict, CamerasThatAgreeWithNoOtherAreNotCountedAsUnseen) {
  RefinementResult result = Refined();
  result.refined.corrections[1].held = true;
  result.standings[1].compared = 100;
  const v1::Verdict verdict = RefinementVerdict(result);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(verdict.reason(), "camera b agrees with no other");
  EXPECT_EQ(verdict.others_size(), 0);
}

}  // namespace
}  // namespace weft
