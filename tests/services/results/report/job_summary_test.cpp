#include "services/results/report/job_summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/services/results/report/proto_text.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

v1::FrameReport MeshFrame(const std::string& name, int observed, int observable) {
  v1::FrameReport frame;
  frame.set_frame(name);
  frame.set_state(v1::FRAME_STATE_DONE);
  frame.mutable_mesh()->set_observed(observed);
  frame.mutable_mesh()->set_vertices_with_cell(observable);
  frame.mutable_mesh()->set_coverage(static_cast<double>(observed) / observable);
  return frame;
}

v1::FrameReport FailedWith(const std::string& reason) {
  v1::FrameReport frame;
  frame.set_state(v1::FRAME_STATE_FAILED);
  frame.set_reason(reason);
  return frame;
}

v1::FrameReport FrameWithBias(int observations, double mean_x_px, double rms_px) {
  v1::FrameReport frame;
  v1::ViewReport& view = *frame.add_views();
  view.set_camera("c01");
  view.mutable_bias()->set_observations(observations);
  view.mutable_bias()->set_mean_x_px(mean_x_px);
  view.mutable_bias()->set_rms_px(rms_px);
  return frame;
}

v1::PageCamera BiasedCamera(const std::string& name, double x_px, double significance) {
  v1::PageCamera camera;
  camera.set_camera(name);
  camera.set_bias_x_px(x_px);
  camera.set_bias_significance(significance);
  return camera;
}

TEST(JobSummary, MediansLeaveOutWhatIsNotFinite) {
  EXPECT_DOUBLE_EQ(MedianOf({3, std::nan(""), 1, 2}), 2);
  EXPECT_DOUBLE_EQ(MedianOf({4, 1, 2, 3}), 2.5);
  EXPECT_TRUE(std::isnan(MedianOf({std::nan("")})));
}

TEST(JobSummary, CoverageCountsCellsNotFrames) {
  const JobSummary summary = Summarize({}, {MeshFrame("1", 90, 90), MeshFrame("2", 1, 10)});
  EXPECT_DOUBLE_EQ(summary.coverage, 0.91);
  EXPECT_DOUBLE_EQ(summary.lowest_coverage, 0.1);
  EXPECT_DOUBLE_EQ(summary.highest_coverage, 1);
  EXPECT_EQ(summary.lowest_coverage_frame, "2");
  EXPECT_EQ(summary.registered, 2);
  EXPECT_TRUE(std::isnan(Summarize({}, {}).coverage));
}

TEST(JobSummary, CountsOfTheJobAreTakenWhereItHasThem) {
  v1::Job job;
  EXPECT_EQ(Summarize(job, {MeshFrame("1", 1, 1), FailedWith("")}).counts.failed(), 1);
  job.mutable_frames()->set_total(9);
  job.mutable_frames()->set_failed(4);
  EXPECT_EQ(Summarize(job, {MeshFrame("1", 1, 1)}).counts.failed(), 4);
}

// Squares are pooled: sqrt((1 * 1 + 3 * 9) / 4); the shift is the mean over the frames.
TEST(JobSummary, ResidualsArePooledByObservations) {
  const JobSummary summary = Summarize({}, {FrameWithBias(1, 0.2, 1), FrameWithBias(3, 0.4, 3)});
  ASSERT_EQ(summary.cameras.size(), 1u);
  EXPECT_DOUBLE_EQ(summary.cameras[0].residual_px(), std::sqrt(7.0));
  EXPECT_DOUBLE_EQ(summary.cameras[0].bias_x_px(), 0.3);
  EXPECT_EQ(summary.cameras[0].frames_with_bias(), 2);
}

TEST(JobSummary, FrequentReasonsComeFirst) {
  EXPECT_THAT(Summarize({}, {FailedWith("b"), FailedWith("a"), FailedWith("b")}).failure_reasons,
              ElementsAre(Pair("b", 2), Pair("a", 1)));
}

TEST(JobSummary, OneWrongCameraDoesNotAccuseThoseItPullsAlong) {
  JobSummary summary;
  summary.cameras = {BiasedCamera("pulled", 0.4, 9), BiasedCamera("moved", 1, 30),
                     BiasedCamera("chance", 2, 3)};
  const std::vector<CameraAlarm> alarms = CameraAlarms(summary);
  ASSERT_EQ(alarms.size(), 1u);
  EXPECT_THAT(alarms[0].text, HasSubstr("Camera moved moved"));
  summary.cameras = {BiasedCamera("tiny", 0.19, 50)};
  EXPECT_TRUE(CameraAlarms(summary).empty());
}

TEST(JobSummary, TheHeadlineSaysWhatCameOut) {
  v1::Job job;
  JobSummary summary;
  summary.coverage = std::nan("");
  EXPECT_EQ(Headline(job, summary), "No frames.");
  summary.counts.set_total(1);
  EXPECT_EQ(Headline(job, summary), "The frame was not registered.");
  summary.counts.set_total(1200);
  summary.registered = 1100;
  summary.coverage = 0.952;
  EXPECT_EQ(Headline(job, summary), "1,100 of 1,200 frames registered, 95.2\xC2\xA0% of the cells observed.");
  job.set_state(v1::JOB_STATE_RUNNING);
  job.mutable_driven();
  EXPECT_EQ(Headline(job, summary), "Still running: 1,100 of 1,200 frames driven so far.");
}

TEST(JobSummary, RemarksExplainThreeReasonsAndCountTheRest) {
  JobSummary summary;
  summary.counts.set_failed(10);
  summary.counts.set_bridged(1);
  summary.failure_reasons = {{"dark", 4}, {"", 2}, {"x", 1}, {"y", 1}};
  const std::vector<std::string> remarks = Remarks({}, summary);
  EXPECT_THAT(remarks, ElementsAre("4 frames failed: dark", "2 frames failed.", "1 frame failed: x",
                                   "3 frames failed for other reasons (see the table of frames).",
                                   HasSubstr("1 of them is bridged")));
}

v1::ReasonCount& AddCount(const std::string& reason, int count,
                          google::protobuf::RepeatedPtrField<v1::ReasonCount>& counts) {
  v1::ReasonCount& added = *counts.Add();
  added.set_reason(reason), added.set_count(count);
  return added;
}

TEST(JobSummary, CamerasAreSummedUpOverTheFrames) {
  std::vector<v1::FrameReport> frames(4);
  for (int f = 0; f < 3; ++f) {
    v1::ViewReport& view = *frames[f].add_views();
    view.set_camera("c01");
    view.set_centers(10 + f), view.set_corners(20 + f), view.set_patches_accepted(30 + f);
    AddCount("too small", 1, *view.mutable_patches_rejected());
    AddCount("no margin", 2 + f, *view.mutable_patches_rejected());
    view.set_grey_levels(f == 0 ? 0 : 100 * f);
    if (f > 0) view.set_moved_ms(f == 1 ? -3 : 2);
    if (f == 2) continue;
    view.mutable_bias()->set_observations(100);
    view.mutable_bias()->set_rms_px(f == 0 ? 3 : 4);
    view.mutable_bias()->set_mean_x_px(f == 0 ? 1 : 2);
    view.mutable_bias()->set_mean_y_px(f == 0 ? -1 : -4);
    view.mutable_bias()->set_significance(f == 0 ? 6 : 10);
  }
  v1::ViewReport& lost = *frames[3].add_views();
  lost.set_camera("c01"), lost.set_missing_reason("no file"), lost.set_centers(1000);
  frames[3].add_views()->set_camera("c02");
  const JobSummary summary = Summarize({}, frames);
  ASSERT_EQ(summary.cameras.size(), 2u);
  EXPECT_EQ(
      summary.cameras[0].DebugString(),
      TextOf<v1::PageCamera>(
          R"(camera: "c01" frames_seen: 3 frames_missing: 1 missing_reasons { reason: "no file" count: 1 }
frames_moved: 2 longest_move_ms: 3 centers: 33 corners: 63 patches_accepted: 93 patches_rejected {
reason: "no margin" count: 9 } patches_rejected { reason: "too small" count: 3 } residual_px:
3.5355339059327378 frames_with_bias: 2 bias_x_px: 1.5 bias_y_px: -2.5 bias_significance: 8
median_grey_levels: 150)"));
  EXPECT_EQ(
      summary.cameras[1].DebugString(),
      TextOf<v1::PageCamera>(R"(camera: "c02" frames_seen: 1 residual_px: nan median_grey_levels: nan)"));
}

TEST(JobSummary, GarmentsAreSummedUpOverTheRegisteredFrames) {
  std::vector<v1::FrameReport> frames = {MeshFrame("1", 1, 2), MeshFrame("2", 1, 2), MeshFrame("3", 1, 2)};
  frames[2].set_state(v1::FRAME_STATE_FAILED);
  for (int f = 0; f < 3; ++f) {
    v1::GarmentReport& garment = *frames[f].mutable_mesh()->add_garments();
    garment.set_id("shirt"), garment.set_vertices(50);
    garment.set_observed(f == 0 ? 30 : 20), garment.set_vertices_with_cell(40);
    garment.set_coverage(f == 0 ? 0.75 : 0.5);
    garment.set_median_observed_sigma_mm(f == 0 ? 0.1 : 0.3);
    v1::GarmentOverlap& overlap = *frames[f].mutable_mesh()->add_overlaps();
    overlap.set_inner("shirt"), overlap.set_outer(f == 0 ? "coat" : "vest");
  }
  frames[1].mutable_mesh()->add_garments()->set_id("coat");
  const JobSummary summary = Summarize({}, frames);
  ASSERT_EQ(summary.garments.size(), 2u);
  EXPECT_EQ(
      summary.garments[0].DebugString(),
      TextOf<v1::PageGarment>(
          R"(id: "shirt" vertices: 50 coverage: 0.625 lowest_coverage: 0.5 lowest_coverage_frame: "2" median_sigma_mm:
0.2)"));
  EXPECT_EQ(summary.garments[1].DebugString(),
            TextOf<v1::PageGarment>(R"(id: "coat" lowest_coverage_frame: "2")"));
  EXPECT_THAT(summary.overlaps, ElementsAre(Pair(Pair("shirt", "coat"), 1), Pair(Pair("shirt", "vest"), 2)));
}

TEST(JobSummary, FiguresAreMediansOfTheRegisteredFrames) {
  std::vector<v1::FrameReport> frames = {MeshFrame("1", 3, 4), MeshFrame("2", 2, 4), MeshFrame("3", 1, 4)};
  frames[1].set_state(v1::FRAME_STATE_DEGRADED);
  frames[2].set_state(v1::FRAME_STATE_FAILED);
  for (int f = 0; f < 3; ++f) {
    frames[f].mutable_cloud()->set_centers(100 + 10 * f);
    frames[f].mutable_mesh()->set_median_observed_sigma_mm(1 + f);
    frames[f].set_total_ms(1000 * (f + 1));
    frames[f].set_peak_memory_mib(f == 2 ? 900 : 500);
  }
  v1::Job job;
  job.set_started_unix_ns(1'000'000'000), job.set_finished_unix_ns(3'500'000'000);
  JobSummary summary = Summarize(job, frames);
  EXPECT_EQ(summary.counts.ShortDebugString(), "total: 3 done: 1 degraded: 1 failed: 1");
  EXPECT_EQ(summary.registered, 2);
  EXPECT_EQ(summary.coverage, 0.625);
  EXPECT_EQ(summary.lowest_coverage, 0.5);
  EXPECT_EQ(summary.lowest_coverage_frame, "2");
  EXPECT_EQ(summary.highest_coverage, 0.75);
  EXPECT_EQ(summary.median_cells, 105);
  EXPECT_EQ(summary.median_sigma_mm, 1.5);
  EXPECT_EQ(summary.median_frame_ms, 1500);
  EXPECT_EQ(summary.peak_memory_mib, 900) << "failed frames take memory as well";
  EXPECT_EQ(summary.wall_ms, 2500);
  EXPECT_FALSE(summary.is_driven);
  EXPECT_TRUE(std::isnan(summary.median_rays) && std::isnan(summary.median_residual_px));
  job.set_finished_unix_ns(1'000'000'000);
  EXPECT_EQ(Summarize(job, frames).wall_ms, 0);
  job.set_finished_unix_ns(999'999'999);
  EXPECT_TRUE(std::isnan(Summarize(job, frames).wall_ms));
  EXPECT_TRUE(std::isnan(Summarize({}, frames).wall_ms)) << "it has not begun";

  for (int f = 0; f < 2; ++f) {
    v1::DrivenReport& driven = *frames[f].mutable_driven();
    driven.set_rays(50 + f), driven.set_rejected_rays(10), driven.set_residual_px(2 + f);
    driven.set_median_sigma_mm(5 + f);
  }
  summary = Summarize(job, frames);
  EXPECT_TRUE(summary.is_driven);
  EXPECT_EQ(summary.median_rays, 40.5);
  EXPECT_EQ(summary.median_residual_px, 2.5);
  EXPECT_EQ(summary.median_sigma_mm, 5.5);
  EXPECT_TRUE(std::isnan(summary.coverage) && std::isnan(summary.lowest_coverage));
}

TEST(JobSummary, EveryStateOfAFrameIsCounted) {
  std::vector<v1::FrameReport> frames;
  for (const auto& [state, count] : {std::pair{v1::FRAME_STATE_DONE, 1},
                                     {v1::FRAME_STATE_DEGRADED, 2},
                                     {v1::FRAME_STATE_FAILED, 3},
                                     {v1::FRAME_STATE_CANCELLED, 4},
                                     {v1::FRAME_STATE_RUNNING, 5},
                                     {v1::FRAME_STATE_UNSPECIFIED, 6}})
    for (int i = 0; i < count; ++i) frames.emplace_back().set_state(state);
  for (v1::FrameReport& frame : frames) frame.mutable_temporal()->set_bridged(true);
  EXPECT_EQ(Summarize({}, frames).counts.ShortDebugString(),
            "total: 21 waiting: 6 running: 5 done: 1 degraded: 2 failed: 3 cancelled: 4 bridged: 3");
}

TEST(JobSummary, WordsAreThoseOfTheKindOfJob) {
  v1::Job job;
  EXPECT_STREQ(DoneWord(job), "registered");
  job.mutable_driven();
  EXPECT_STREQ(DoneWord(job), "driven");
  job.mutable_spec()->mutable_work();
  EXPECT_STREQ(DoneWord(job), "done");
}

TEST(JobSummary, RemarksOfEveryCount) {
  v1::Job job;
  job.set_message("the disk was slow");
  JobSummary summary;
  const auto set = [&](int n) {
    summary.counts.set_failed(n), summary.counts.set_bridged(n), summary.counts.set_degraded(n);
    summary.counts.set_cancelled(n), summary.counts.set_reused(n);
  };
  set(1);
  EXPECT_THAT(
      Remarks(job, summary),
      ElementsAre("the disk was slow", "1 frame failed for other reasons (see the table of frames).",
                  "1 of them is bridged: the mesh comes from the frames around.",
                  "1 frame is degraded: it was registered, with cameras missing.",
                  "1 frame was not computed.", "1 frame was found complete from an earlier run and kept."));
  set(1200);
  job.clear_message();
  EXPECT_THAT(Remarks(job, summary),
              ElementsAre("1,200 frames failed for other reasons (see the table of frames).",
                          "1,200 of them are bridged: the mesh comes from the frames around.",
                          "1,200 frames are degraded: they were registered, with cameras missing.",
                          "1,200 frames were not computed.",
                          "1,200 frames were found complete from an earlier run and kept."));
  set(0);
  EXPECT_TRUE(Remarks(job, summary).empty());
}

// A camera with this distance from the others' points, of so many observations.
CameraStanding StandingAt(const std::string& name, double median_px, int64_t compared = kLeastCompared) {
  CameraStanding standing;
  standing.camera = name, standing.median_px = median_px;
  standing.compared = standing.agreeing = compared;
  standing.frames = 1;
  return standing;
}

TEST(JobSummary, CamerasBesideTheirPlaceEverywhereHaveAnAlarm) {
  const auto alarmed = [](const std::vector<CameraStanding>& cameras) {
    JobSummary summary;
    summary.facts.cameras = cameras;
    std::vector<std::string> texts;
    for (const CameraAlarm& alarm : CameraAlarms(summary)) texts.push_back(alarm.text + "|" + alarm.remedy);
    return texts;
  };
  EXPECT_THAT(
      alarmed({StandingAt("a", 0.1), StandingAt("b", 0.1), StandingAt("late", 0.5)}),
      ElementsAre(
          "Camera late moved, its calibration is off, or its images are of another moment: it sees cells 0.5 "
          "px from where the others see them, most cameras 0.1 px.|See first whether its images are late: "
          "`weft take sync` tells of a take, and `weft take trim TAKE --out OTHER --shift late=MS` moves its "
          "times. `weft rig refine` corrects cameras that moved, no late ones."));
  EXPECT_TRUE(alarmed({StandingAt("a", 0.1), StandingAt("b", 0.1), StandingAt("late", 0.49)}).empty());
  EXPECT_TRUE(alarmed({StandingAt("a", 0.01), StandingAt("b", 0.01), StandingAt("c", 0.29)}).empty())
      << "too little";
  EXPECT_EQ(alarmed({StandingAt("a", 0.01), StandingAt("b", 0.01), StandingAt("c", 0.3)}).size(), 1u);
  EXPECT_TRUE(alarmed({StandingAt("a", 0.1), StandingAt("b", 0.1), StandingAt("late", 9, kLeastCompared - 1)})
                  .empty());
}

TEST(JobSummary, AlarmsNeedALengthAndASignificance) {
  const auto alarms = [](double x_px, double significance) {
    JobSummary summary;
    summary.cameras = {BiasedCamera("c", x_px, significance)};
    return CameraAlarms(summary).size();
  };
  EXPECT_EQ(alarms(0.2, 9), 0u);
  EXPECT_EQ(alarms(0.21, 9), 1u);
  EXPECT_EQ(alarms(0.21, 4), 0u);
  EXPECT_EQ(alarms(-0.21, 4.1), 1u);
  JobSummary two;
  two.cameras = {BiasedCamera("half", 1, 9), BiasedCamera("worst", 2, 9), BiasedCamera("less", 0.99, 9)};
  const std::vector<CameraAlarm> both = CameraAlarms(two);
  ASSERT_EQ(both.size(), 2u);
  EXPECT_THAT(both[0].text, HasSubstr("Camera worst moved"));
  EXPECT_EQ(both[0].remedy, "Correct the rig with `weft rig refine`, or calibrate again.");
  two.facts.cameras = {StandingAt("half", 9), StandingAt("other", 0.1), StandingAt("third", 0.1)};
  EXPECT_EQ(CameraAlarms(two).size(), 2u) << "told once";
}

}  // namespace
}  // namespace weft
