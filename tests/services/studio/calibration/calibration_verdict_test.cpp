// The words and grades of calibrations and refinements, of results made by hand.
#include <gmock/gmock.h>
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
  const auto text = CalibrationJson(result);
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

}  // namespace
}  // namespace weft
