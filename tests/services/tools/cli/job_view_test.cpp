#include "services/tools/cli/job_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "services/tools/cli/progress.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

v1::FrameInfo DoneFrame(double coverage) {
  v1::FrameInfo info;
  info.set_frame("0007");
  info.set_state(v1::FRAME_STATE_DONE);
  info.set_coverage(coverage);
  info.set_total_ms(1800);
  return info;
}

TEST(FrameLine, SaysWhatWasObservedOfRegisteredFrames) {
  EXPECT_EQ(FrameLine(DoneFrame(0.932), true), "0007    done        93.2 % of the cells     1.8 s");
}

TEST(FrameLine, DrivenFramesHaveNoShareOfCells) {
  EXPECT_EQ(FrameLine(DoneFrame(0), false), "0007    done          1.8 s");
}

TEST(JobText, NamesWhatWasDone) {
  v1::Job job;
  job.mutable_frames()->set_total(12);
  job.mutable_frames()->set_done(12);
  EXPECT_EQ(JobText(job), "12 of 12 frames registered");
  job.mutable_spec()->mutable_driving();
  EXPECT_EQ(JobText(job), "12 of 12 frames driven");
  job.mutable_frames()->set_done(11);
  job.mutable_frames()->set_failed(1);
  EXPECT_THAT(OutcomeOf(job).message(), HasSubstr("could not be driven"));
  EXPECT_THAT(OutcomeOf(job).message(), Not(HasSubstr("registered")));
}

TEST(FrameLine, SaysHowAFrameEnded) {
  v1::FrameInfo info = DoneFrame(0.5);
  info.set_state(v1::FRAME_STATE_DEGRADED);
  info.set_reason("camera c2 has no image");
  info.set_latency_s(2.25);
  EXPECT_EQ(FrameLine(info, true),
            "0007    degraded    50.0 % of the cells     1.8 s  2.2 s after its recording  (camera c2 has no "
            "image)");
  info.set_reused(true);
  info.set_latency_s(0);
  info.set_reason("");
  EXPECT_EQ(FrameLine(info, true), "0007    degraded    50.0 % of the cells  kept from an earlier run");
  info.set_state(v1::FRAME_STATE_FAILED);
  info.set_reason("no cell was seen");
  EXPECT_EQ(FrameLine(info, true), "0007    failed     (no cell was seen)");
  info.set_bridged(true);
  EXPECT_EQ(FrameLine(info, true), "0007    bridged    (no cell was seen)");
  info.set_state(v1::FRAME_STATE_WAITING);
  EXPECT_EQ(FrameLine(info, true), "0007    waiting    (no cell was seen)");
  info.set_state(v1::FRAME_STATE_UNSPECIFIED);
  EXPECT_EQ(FrameLine(info, true), "0007    unknown    (no cell was seen)");
}

TEST(JobText, CountsWhatBecameOfTheFrames) {
  v1::Job job;
  v1::FrameCounts& frames = *job.mutable_frames();
  frames.set_total(20);
  frames.set_done(9);
  frames.set_degraded(2);
  frames.set_reused(3);
  frames.set_failed(5);
  frames.set_bridged(1);
  frames.set_cancelled(4);
  EXPECT_EQ(
      JobText(job),
      "11 of 20 frames registered (2 with cameras missing), 3 kept from an earlier run, 1 bridged, 4 failed, "
      "4 cancelled");
  frames.Clear();
  frames.set_total(1);
  frames.set_failed(1);
  frames.set_bridged(1);
  EXPECT_EQ(JobText(job), "0 of 1 frame registered, 1 bridged");
  job.mutable_live()->set_following(true);
  job.mutable_live()->set_backlog(3);
  job.mutable_live()->set_latency_s(1.5);
  EXPECT_EQ(JobText(job), "0 of 1 frame registered, 1 bridged") << "it does not run";
  job.set_state(v1::JOB_STATE_RUNNING);
  EXPECT_EQ(JobText(job),
            "0 of 1 frame registered, 1 bridged; live, 3 behind, the newest 1.5 s after its recording");
  job.mutable_live()->set_following(false);
  EXPECT_EQ(JobText(job), "0 of 1 frame registered, 1 bridged");
}

TEST(JobStateWord, IsTheNameOfTheState) {
  EXPECT_STREQ(JobStateWord(v1::JOB_STATE_QUEUED), "queued");
  EXPECT_STREQ(JobStateWord(v1::JOB_STATE_UNSPECIFIED), "unknown");
}

TEST(OutcomeOf, IsThatOfTheVerdictWhereThereIsOne) {
  v1::Job job;
  job.mutable_frames()->set_total(2);
  EXPECT_TRUE(OutcomeOf(job).ok());
  job.mutable_frames()->set_failed(1);
  EXPECT_EQ(OutcomeOf(job),
            absl::InternalError("1 of 2 frames could not be registered; the reasons are above and in "
                                "the report"));
  job.set_state(v1::JOB_STATE_FAILED);
  job.set_message("the disk is full");
  EXPECT_EQ(OutcomeOf(job), absl::InternalError("the disk is full"));
  job.mutable_verdict()->set_grade(v1::GRADE_USABLE);
  EXPECT_TRUE(OutcomeOf(job).ok());
  job.mutable_verdict()->set_grade(v1::GRADE_BAD);
  EXPECT_EQ(OutcomeOf(job).code(), absl::StatusCode::kAborted);
  job.set_state(v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(OutcomeOf(job),
            absl::CancelledError("the job was cancelled: 0 of 2 frames registered, 1 failed; run the "
                                 "command again to go on"));
}

// A frame of `state`, and the job that has `done` of two.
v1::JobUpdate UpdateOf(const std::string& frame, v1::FrameState state, int done) {
  v1::JobUpdate update;
  update.mutable_job()->mutable_frames()->set_total(2);
  update.mutable_job()->mutable_frames()->set_done(done);
  v1::FrameInfo& info = *update.add_frames();
  info.set_frame(frame);
  info.set_state(state);
  info.set_coverage(0.5);
  info.set_total_ms(3000);
  info.set_share_done(0.25);
  return update;
}

std::string ShownBy(bool quiet, const std::vector<v1::JobUpdate>& updates) {
  testing::internal::CaptureStderr();
  {
    JobView view(quiet);
    for (const v1::JobUpdate& update : updates) view.Show(update);
  }
  return testing::internal::GetCapturedStderr();
}

TEST(JobView, ShowsFramesWhenTheyEnd) {
  std::vector<v1::JobUpdate> updates = {
      UpdateOf("0000", v1::FRAME_STATE_RUNNING, 0), UpdateOf("0000", v1::FRAME_STATE_DONE, 1),
      UpdateOf("0001", v1::FRAME_STATE_DEGRADED, 2), UpdateOf("0002", v1::FRAME_STATE_FAILED, 2),
      UpdateOf("0003", v1::FRAME_STATE_WAITING, 2)};
  EXPECT_EQ(
      ShownBy(false, updates),
      "0000    done        50.0 % of the cells     3.0 s\n0001    degraded    50.0 % of the cells     3.0 s\n"
      "0002    failed   \n");
  EXPECT_EQ(ShownBy(true, updates), "");
  updates.resize(2);
  updates[1].mutable_job()->mutable_spec()->mutable_driving();
  EXPECT_EQ(ShownBy(false, updates), "0000    done          3.0 s\n");
}

// Why results of an earlier run are not kept is said once.
TEST(JobView, SaysOnceWhyFramesAreDoneAnew) {
  std::vector<v1::JobUpdate> updates;
  for (const char* frame : {"0000", "0001"}) {
    updates.push_back(UpdateOf(frame, v1::FRAME_STATE_DONE, 1));
    updates.back().mutable_frames(0)->set_redone_from("align");
    updates.back().mutable_frames(0)->set_redone_because("align has version 2, was 1");
  }
  const std::string shown = ShownBy(false, updates);
  EXPECT_EQ(shown.find("results of an earlier run are "), 0u) << shown;
  EXPECT_EQ(shown.rfind("results of an earlier run are "), 0u) << shown;
  EXPECT_THAT(shown, HasSubstr("align has version 2, was 1"));
  EXPECT_EQ(std::count(shown.begin(), shown.end(), '\n'), 3);
  EXPECT_EQ(ShownBy(true, updates), "");
}

// For programs that watch: thousandths of the job, with the shares of frames that run.
TEST(JobViewDeathTest, TheBarCountsFramesThatRun) {
  const auto watch = [] {
    PrintProgressAsLines();
    {
      JobView view(false, "watch");
      view.Show(UpdateOf("0000", v1::FRAME_STATE_RUNNING, 1));
      v1::JobUpdate ended = UpdateOf("0000", v1::FRAME_STATE_DONE, 1);
      v1::FrameCounts& frames = *ended.mutable_job()->mutable_frames();
      frames.set_total(16), frames.set_degraded(1), frames.set_failed(1), frames.set_cancelled(1);
      view.Show(ended);
      view.Show(UpdateOf("0001", v1::FRAME_STATE_DONE, 2));
    }
    std::exit(0);
  };
  EXPECT_EXIT(watch(), testing::ExitedWithCode(0),
              "watch: 0 of 1000\n.*watch: 625 of 1000\n.*watch: 250 of 1000\n");
}

}  // namespace
}  // namespace weft
