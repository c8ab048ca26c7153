#include "services/results/report/job_summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace weft
