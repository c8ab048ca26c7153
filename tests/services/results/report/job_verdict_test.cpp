#include "services/results/report/job_verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/results/report/job_summary.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// A registered frame of four cameras with 100 cells each.
v1::FrameReport ReportOf(const std::string& name) {
  v1::FrameReport frame;
  frame.set_frame(name);
  frame.set_state(v1::FRAME_STATE_DONE);
  for (const char* camera : {"a", "b", "c", "d"}) {
    v1::ViewReport& view = *frame.add_views();
    view.set_camera(camera);
    view.set_centers(100);
  }
  frame.mutable_cloud()->set_centers(190);
  frame.mutable_cloud()->set_corners(180);
  frame.mutable_mesh()->set_vertices_with_cell(200);
  frame.mutable_mesh()->set_observed(180);
  frame.mutable_mesh()->set_coverage(0.9);
  return frame;
}

v1::Job JobOf(int done, int failed) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_DONE);
  job.mutable_frames()->set_total(done + failed);
  job.mutable_frames()->set_done(done);
  job.mutable_frames()->set_failed(failed);
  return job;
}

void Reject(v1::FrameReport& frame, const std::string& reason, int count) {
  v1::ReasonCount& rejected = *frame.mutable_cloud()->add_rejected();
  rejected.set_reason(reason);
  rejected.set_count(count);
}

TEST(JobVerdict, SaysWhatAGoodJobCameTo) {
  const v1::Verdict verdict = AssessJob(JobOf(2, 0), {ReportOf("0"), ReportOf("1")});
  EXPECT_EQ(verdict.grade(), v1::GRADE_GOOD);
  EXPECT_EQ(verdict.reason(), "2 of 2 frames registered, 90.0 % of the cells observed");
  EXPECT_EQ(verdict.remedy(), "");
  EXPECT_EQ(verdict.checks_size(), 7);
}

TEST(JobVerdict, HardlyAnyCellIsAnotherBoard) {
  v1::FrameReport frame = ReportOf("0");
  frame.set_state(v1::FRAME_STATE_FAILED);
  frame.clear_mesh();
  frame.clear_cloud();
  for (v1::ViewReport& view : *frame.mutable_views()) view.set_centers(1);
  const v1::Verdict verdict = AssessJob(JobOf(0, 1), {frame});
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_THAT(verdict.reason(), HasSubstr("4 in 4 images: is it the right board?"));
}

TEST(JobVerdict, RaysThatHardlyMeetAreAnotherRig) {
  v1::FrameReport frame = ReportOf("0");
  Reject(frame, "no_consensus", 1000);
  Reject(frame, "too_few_views", 1000);
  const v1::Verdict verdict = AssessJob(JobOf(1, 0), {frame});
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_THAT(verdict.reason(), HasSubstr("at 370 of 1370 cells and corners: is it the rig of this take?"));
}

// A frame that a flash lit does not hide that the camera is dark.
TEST(JobVerdict, ADarkCameraIsNamed) {
  std::vector<v1::FrameReport> frames;
  for (const double levels : {9, 10, 120}) {
    frames.push_back(ReportOf(absl::StrCat(frames.size())));
    for (v1::ViewReport& view : *frames.back().mutable_views()) view.set_grey_levels(140);
    frames.back().mutable_views(2)->set_grey_levels(levels);
  }
  const v1::Verdict verdict = AssessJob(JobOf(3, 0), frames);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(),
              HasSubstr("camera c is dark or has few bits: its print spans 10 grey levels"));
}

TEST(JobVerdict, CellsOffTheTemplateAreAnotherTemplate) {
  v1::FrameReport frame = ReportOf("0");
  frame.mutable_mesh()->set_unclaimed_points(150);
  const v1::Verdict verdict = AssessJob(JobOf(1, 0), {frame});
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("150 of 190 triangulated cells"));
}

TEST(JobVerdict, ScansThatFindNothingAreNotGreen) {
  const auto assessed = [](int found, double distance_mm) {
    v1::FrameReport frame = ReportOf("0");
    v1::ScanReport& scan = *frame.mutable_mesh()->mutable_scan();
    scan.set_points(40000);
    scan.set_found(found);
    scan.set_median_distance_mm(distance_mm);
    return AssessJob(JobOf(1, 0), {frame});
  };
  EXPECT_EQ(assessed(39000, 0.4).grade(), AssessJob(JobOf(1, 0), {ReportOf("0")}).grade());
  const v1::Verdict away = assessed(0, 0);
  EXPECT_EQ(away.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(away.reason(), HasSubstr("no point of the scans lies on the cloth"));
  const v1::Verdict beside = assessed(12000, 3);
  EXPECT_EQ(beside.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(beside.reason(), HasSubstr("distance of scans from the cloth"));
}

TEST(JobVerdict, AMapThatFitsElsewhereIsBad) {
  v1::FrameReport moved = ReportOf("0");
  v1::MapPlaceReport& place = *moved.mutable_mesh()->mutable_map_fits();
  place.set_rows(-1);
  place.set_cols(-1);
  place.set_cells(1000);
  place.set_outside(30);
  place.set_outside_there(2);
  const v1::Verdict verdict = AssessJob(JobOf(2, 0), {moved, moved});
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_THAT(verdict.reason(),
              HasSubstr("60 of 2000 triangulated cells have no vertex, 4 have none once its "
                        "rows move by -1 and its columns by -1"));
  place.set_half_turn(true);
  EXPECT_THAT(AssessJob(JobOf(1, 0), {moved}).reason(), HasSubstr("turned by half a turn on the board"));
  // A frame in which little was seen says nothing of the others.
  EXPECT_NE(AssessJob(JobOf(2, 0), {moved, ReportOf("1")}).grade(), v1::GRADE_BAD);
}

TEST(JobVerdict, CountsFramesAndImages) {
  v1::FrameReport failed;
  failed.set_frame("1");
  failed.set_state(v1::FRAME_STATE_FAILED);
  failed.set_reason("too little was seen");
  v1::Verdict verdict = AssessJob(JobOf(1, 1), {ReportOf("0"), failed});
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_EQ(verdict.reason(), "1 of 2 frames could not be registered: too little was seen");
  std::vector<v1::FrameReport> frames(19, ReportOf("0"));
  frames.push_back(failed);
  EXPECT_EQ(AssessJob(JobOf(19, 1), frames).grade(), v1::GRADE_USABLE);

  v1::FrameReport degraded = ReportOf("0");
  degraded.mutable_views(1)->set_missing_reason("b.png: no such file");
  verdict = AssessJob(JobOf(1, 0), {degraded});
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("1 of 4 images could not be used, the first: b.png"));
}

TEST(JobVerdict, CancelledJobsGoOn) {
  v1::Job job = JobOf(1, 0);
  job.set_state(v1::JOB_STATE_CANCELLED);
  job.mutable_frames()->set_total(3);
  const v1::Verdict verdict = AssessJob(job, {ReportOf("0")});
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_EQ(verdict.reason(), "cancelled with 1 of 3 frames registered");
  EXPECT_THAT(verdict.remedy(), HasSubstr("resumes"));
}

// In four cameras, `count` of them apart.
v1::FrameReport WithAgreement(v1::FrameReport frame, int apart, const std::string& fits = "") {
  for (int v = 0; v < frame.views_size(); ++v) {
    v1::CameraAgreement& agreement = *frame.mutable_views(v)->mutable_agreement();
    agreement.set_compared(300);
    agreement.set_agreeing(v < apart ? 10 : 299);
    agreement.set_median_px(v < apart ? 120 : 0.1);
    agreement.set_scale(1);
    agreement.set_scale_sigma(1e-4);
    if (v < apart && !fits.empty()) agreement.set_fits_camera(fits);
  }
  return frame;
}

TEST(JobVerdict, ACameraThatAgreesWithNoOtherCounts) {
  EXPECT_EQ(AssessJob(JobOf(1, 0), {WithAgreement(ReportOf("0"), 0)}).grade(), v1::GRADE_GOOD);
  v1::Verdict verdict = AssessJob(JobOf(1, 0), {WithAgreement(ReportOf("0"), 1)});
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("camera a agrees with no other"));
  v1::FrameReport exchanged = WithAgreement(ReportOf("0"), 2, "a");
  exchanged.mutable_views(0)->mutable_agreement()->set_fits_camera("b");
  // It says more than that the rays hardly meet.
  Reject(exchanged, "no_consensus", 1000);
  verdict = AssessJob(JobOf(1, 0), {exchanged});
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  EXPECT_THAT(verdict.reason(), HasSubstr("cameras a and b are exchanged"));
  // Of another rig no camera agrees with any other.
  v1::FrameReport other = WithAgreement(ReportOf("0"), 4);
  Reject(other, "no_consensus", 1000);
  EXPECT_THAT(AssessJob(JobOf(1, 0), {other}).reason(), HasSubstr("is it the rig of this take?"));
}

// A camera that is exchanged did not move.
TEST(JobVerdict, NoAlarmIsRaisedOfCamerasThatAgreeWithNoOther) {
  v1::FrameReport frame = WithAgreement(ReportOf("0"), 1);
  v1::CameraBias& bias = *frame.mutable_views(0)->mutable_bias();
  bias.set_observations(100);
  bias.set_mean_x_px(9);
  bias.set_significance(30);
  EXPECT_TRUE(CameraAlarms(Summarize(JobOf(1, 0), {frame})).empty());
  frame.mutable_views(0)->mutable_agreement()->set_agreeing(300);
  EXPECT_EQ(CameraAlarms(Summarize(JobOf(1, 0), {frame})).size(), 1u);
}

// The mean of what it sees is right.
TEST(JobVerdict, ACameraThatMovedAroundTheClothHasAnAlarm) {
  v1::FrameReport frame = WithAgreement(ReportOf("0"), 0);
  for (v1::ViewReport& view : *frame.mutable_views()) view.mutable_agreement()->set_median_px(0.2);
  const auto alarms_at = [&](double median_px) {
    frame.mutable_views(2)->mutable_agreement()->set_median_px(median_px);
    return AssessJob(JobOf(1, 0), {frame});
  };
  EXPECT_EQ(alarms_at(0.9).grade(), v1::GRADE_GOOD);
  EXPECT_EQ(alarms_at(1.1).grade(), v1::GRADE_USABLE);
  EXPECT_THAT(alarms_at(12).reason(),
              HasSubstr("Camera c moved, its calibration is off, or its images are of another "
                        "moment: it sees cells 12 px from where the others see them, most "
                        "cameras 0.2 px"));
}

TEST(JobVerdict, CamerasThatTheRigLacksCount) {
  v1::FrameReport frame = ReportOf("0");
  frame.add_unknown_cameras("e");
  frame.add_unknown_cameras("f");
  const v1::Verdict verdict = AssessJob(JobOf(1, 0), {frame, frame});
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("2 of 6 cameras of the recording are not in the rig"));
}

TEST(JobVerdict, ClothLargerThanItsPrintCounts) {
  v1::FrameReport frame = WithAgreement(ReportOf("0"), 0);
  frame.mutable_cloud()->set_print_scale(1.05);
  EXPECT_THAT(AssessJob(JobOf(1, 0), {frame}).reason(), HasSubstr("not as large as its print"));
  for (v1::ViewReport& view : *frame.mutable_views()) {
    view.mutable_agreement()->set_perspective(-0.05);
    view.mutable_agreement()->set_perspective_sigma(0.005);
  }
  EXPECT_THAT(AssessJob(JobOf(1, 0), {frame}).reason(), HasSubstr("lenses of the rig"));
}

// What a report says whose job has a bit of everything.
TEST(JobVerdict, EveryCheckStandsInTheText) {
  std::vector<v1::FrameReport> frames = {ReportOf("0"), ReportOf("1"), ReportOf("2")};
  frames[2].set_state(v1::FRAME_STATE_FAILED), frames[2].set_reason("too dark");
  frames[1].set_state(v1::FRAME_STATE_DEGRADED);
  for (v1::FrameReport& frame : frames) Reject(frame, "no_consensus", 30);
  frames[1].mutable_views(3)->set_missing_reason("d.png: no such file");
  frames[0].mutable_mesh()->set_unclaimed_points(19);
  v1::ScanReport& scan = *frames[0].mutable_mesh()->mutable_scan();
  scan.set_points(1000), scan.set_found(900), scan.set_median_distance_mm(0.5);
  v1::Job job = JobOf(2, 1);
  const v1::Verdict verdict = AssessJob(job, frames);
  EXPECT_EQ(VerdictText(verdict), R"(bad: 1 of 3 frames could not be registered: too dark
  remedy: See the reasons in the table of frames of report.html, fix them, and run the same command again.
  bad: frames registered: 66.7 % (good from 100 %, usable from 90 %)
  usable: images that could be used: 91.7 % (good from 99 %, usable from 50 %)
  usable: 1 of 12 images could not be used, the first: d.png: no such file
)");
  std::string checks;
  for (const v1::VerdictCheck& check : verdict.checks()) checks += check.id() + " " + check.value() + "\n";
  EXPECT_EQ(checks, R"(decode.cells 109.1
register.rays_meet 92.5 %
register.cameras_known 100.0 %
register.on_template 96.7 %
register.scan_points 90.0 %
register.scan_distance 0.50 mm
register.frames 66.7 %
register.images 91.7 %
register.coverage 90.0 %
)");
}

TEST(JobVerdict, JobsThatFailedSayWhyAndWhatToDo) {
  v1::Job job = JobOf(0, 0);
  job.set_state(v1::JOB_STATE_FAILED);
  EXPECT_EQ(VerdictText(AssessJob(job, {})), "good: 0 of 0 frames registered\n");
  job.set_message("rig.json: no such file");
  EXPECT_EQ(
      VerdictText(AssessJob(job, {})),
      "bad: rig.json: no such file\n  remedy: Fix what the message names, and run the same command again.\n");
  v1::FrameReport failed = ReportOf("0");
  failed.set_state(v1::FRAME_STATE_FAILED), failed.set_reason("too dark");
  job = JobOf(0, 1);
  job.set_state(v1::JOB_STATE_FAILED), job.set_message("all frames failed");
  EXPECT_EQ(AssessJob(job, {failed}).reason(), "1 of 1 frame could not be registered: too dark");
  job.mutable_driven();
  EXPECT_EQ(AssessJob(job, {failed}).reason(), "1 of 1 frame could not be driven: too dark");
}

TEST(JobVerdict, AMapThatMovesAlongOneAxisIsNotSure) {
  v1::FrameReport moved = ReportOf("0");
  v1::MapPlaceReport& place = *moved.mutable_mesh()->mutable_map_fits();
  place.set_rows(2), place.set_cols(0), place.set_cells(100), place.set_outside(30),
      place.set_outside_there(1);
  const v1::Verdict verdict = AssessJob(JobOf(1, 0), {moved});
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_EQ(verdict.reason(),
            "the template's map is of another place of the board, or lacks cells at one border: 30 of 100 "
            "triangulated "
            "cells have no vertex, 1 have none once its rows move by 2 and its columns by 0");
  EXPECT_EQ(verdict.remedy(),
            "Rows and columns of a map count from 0, from the board's corner at the top left: correct it, "
            "and import "
            "the template again.");
  place.set_rows(0), place.set_cols(2);
  EXPECT_EQ(AssessJob(JobOf(1, 0), {moved}).grade(), v1::GRADE_USABLE);
}

TEST(JobVerdict, FewNodesSayNothingOfTheRays) {
  const auto has_rays = [](int points, int apart) {
    v1::FrameReport frame;
    frame.set_state(v1::FRAME_STATE_DONE);
    frame.mutable_cloud()->set_centers(points);
    Reject(frame, "no_consensus", apart);
    const v1::Verdict verdict = AssessJob(JobOf(1, 0), {frame});
    for (const v1::VerdictCheck& check : verdict.checks())
      if (check.id() == "register.rays_meet") return check.value();
    return std::string("none");
  };
  EXPECT_EQ(has_rays(80, 19), "none");
  EXPECT_EQ(has_rays(80, 20), "80.0 %");
}

TEST(JobVerdict, OfAFolderIsThatOfItsFrames) {
  const TempFolder folder;
  v1::FrameReport frame = ReportOf("0");
  std::filesystem::create_directories(folder / "0");
  ASSERT_TRUE(WriteJsonFile(folder / "0/report.json", frame).ok());
  EXPECT_EQ(AssessJobFolder(folder.path(), JobOf(1, 0)).DebugString(),
            AssessJob(JobOf(1, 0), {frame}).DebugString());
  EXPECT_EQ(AssessJobFolder("/nowhere", JobOf(1, 0)).DebugString(), AssessJob(JobOf(1, 0), {}).DebugString());
}

}  // namespace
}  // namespace weft
