#include "services/work/job/job_life.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Job NewJob() {
  v1::Job job;
  job.set_id("j");
  job.mutable_spec()->set_out("/results");
  return job;
}

v1::FrameInfo Ended(const std::string& frame, v1::FrameState state, const std::string& reason = "") {
  v1::FrameInfo info;
  info.set_frame(frame);
  info.set_state(state);
  info.set_reason(reason);
  return info;
}

class JobLifeTest : public ::testing::Test {
 protected:
  void Finish(size_t position, v1::FrameState state, const std::string& reason = "") {
    life_.frames().Start(position);
    life_.frames().Finish(position, Ended(life_.frames().infos()[position].frame(), state, reason));
  }

  JobLife life_{NewJob(), {"a", "b", "c"}};
};

TEST_F(JobLifeTest, BeginsWaiting) {
  const v1::Job job = life_.Describe();
  EXPECT_EQ(job.state(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(job.frames().waiting(), 3);
  EXPECT_EQ(job.first_frame(), "a");
  EXPECT_EQ(job.last_frame(), "c");
  EXPECT_GT(job.created_unix_ns(), 0);
  EXPECT_LT(job.remaining_s(), 0);
  EXPECT_TRUE(life_.Start());
  EXPECT_FALSE(life_.Start());
  EXPECT_EQ(life_.job().state(), v1::JOB_STATE_RUNNING);
}

TEST_F(JobLifeTest, IsDoneWhenAnyFrameIsRegistered) {
  Finish(0, v1::FRAME_STATE_FAILED, "dark");
  Finish(1, v1::FRAME_STATE_DEGRADED);
  Finish(2, v1::FRAME_STATE_FAILED, "blurred");
  const v1::Job job = life_.Outcome({2});
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job.message(), "");
  EXPECT_EQ(job.frames().failed(), 2);
  EXPECT_EQ(job.frames().bridged(), 1);
  EXPECT_EQ(job.remaining_s(), 0);
  EXPECT_GT(job.finished_unix_ns(), 0);
}

TEST_F(JobLifeTest, NamesTheFirstFailureWhenNoneIsRegistered) {
  Finish(2, v1::FRAME_STATE_FAILED, "blurred");
  Finish(0, v1::FRAME_STATE_FAILED, "dark");
  Finish(1, v1::FRAME_STATE_FAILED, "empty");
  const v1::Job job = life_.Outcome({});
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(job.message(), "no frame could be registered; the first, frame a: dark");
}

TEST_F(JobLifeTest, CancelsWhatIsLeftOfAJobThatEndsEarly) {
  Finish(0, v1::FRAME_STATE_DONE);
  life_.frames().Start(1);
  life_.Abort(v1::JOB_STATE_CANCELLED, "cancelled");
  life_.Abort(v1::JOB_STATE_FAILED, "too late to matter");
  const v1::Job job = life_.Outcome({});
  EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(job.message(), "cancelled");
  EXPECT_EQ(job.frames().done(), 1);
  EXPECT_EQ(job.frames().cancelled(), 2);
  EXPECT_EQ(life_.frames().infos()[1].reason(), "cancelled");
}

TEST_F(JobLifeTest, AnEarlyEndIsWrittenDownBeforeItsFrames) {
  Finish(0, v1::FRAME_STATE_DONE);
  life_.Abort(v1::JOB_STATE_CANCELLED, "cancelled");
  const v1::Job written = life_.Describe();
  EXPECT_EQ(written.ends_as(), v1::JOB_STATE_CANCELLED);
  JobLife resumed(written, life_.frames().infos());
  EXPECT_TRUE(resumed.is_aborted());
  resumed.CancelWaiting([](size_t position) { return position == 2; });
  EXPECT_EQ(resumed.frames().infos()[1].state(), v1::FRAME_STATE_CANCELLED);
  EXPECT_EQ(resumed.frames().infos()[2].state(), v1::FRAME_STATE_WAITING);
  const v1::Job job = resumed.Outcome({});
  EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(job.message(), "cancelled");
  EXPECT_EQ(job.ends_as(), v1::JOB_STATE_UNSPECIFIED);
  resumed.Conclude(job);
  EXPECT_TRUE(resumed.Retry());
  EXPECT_FALSE(resumed.is_aborted());
}

TEST_F(JobLifeTest, RegistersFramesAgainAFewTimes) {
  const std::vector<IncompleteFrame> lost = {{1, "mesh.ply is missing"}};
  EXPECT_TRUE(life_.DoAgain({}).ok());
  for (int i = 0; i < kMaxRepairs; ++i) {
    Finish(1, v1::FRAME_STATE_DONE);
    ASSERT_TRUE(life_.DoAgain(lost).ok());
    EXPECT_EQ(life_.frames().infos()[1].state(), v1::FRAME_STATE_WAITING);
  }
  Finish(1, v1::FRAME_STATE_DONE);
  const absl::Status status = life_.DoAgain(lost);
  EXPECT_EQ(status.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(status.message(), HasSubstr("/results: frame b: mesh.ply is missing"));
  EXPECT_EQ(life_.frames().infos()[1].state(), v1::FRAME_STATE_DONE);
}

TEST_F(JobLifeTest, TellsWhoseInputsChangedMeanwhile) {
  for (size_t i = 0; i < 3; ++i) Finish(i, v1::FRAME_STATE_DONE);
  ASSERT_TRUE(life_.DoAgain({{0, "its images changed", true}, {1, "mesh.ply is missing", false}}).ok());
  EXPECT_THAT(life_.job().warnings(),
              ElementsAre("images, scan or start of a changed while the job ran; this frame was registered "
                          "again from what is there now"));
}

TEST_F(JobLifeTest, TellsOnceOfResultsThatWereComputedAgain) {
  for (size_t i = 0; i < 3; ++i) {
    v1::FrameInfo info = Ended(life_.frames().infos()[i].frame(), v1::FRAME_STATE_DONE);
    info.set_redone_from(i < 2 ? "align" : "decode");
    info.set_redone_because(i < 2 ? "align has version 2, was 1" : "its images changed");
    life_.frames().Start(i);
    life_.frames().Finish(i, info);
  }
  EXPECT_THAT(life_.Outcome({}).warnings(),
              ElementsAre("2 frames of an earlier run were computed again from align on, since align has "
                          "version 2, was 1; observations and cloud are kept",
                          "1 frame of an earlier run was computed again from decode on, since its images "
                          "changed"));
  EXPECT_EQ(life_.Outcome({}).warnings_size(), 2) << "asked twice";
}

TEST_F(JobLifeTest, WaitsAgainForItsFailedAndCancelledFrames) {
  EXPECT_FALSE(life_.Retry());
  Finish(0, v1::FRAME_STATE_DONE);
  Finish(1, v1::FRAME_STATE_FAILED, "dark");
  life_.Abort(v1::JOB_STATE_CANCELLED, "cancelled");
  life_.Conclude(life_.Outcome({}));
  ASSERT_TRUE(life_.Retry());
  const v1::Job job = life_.Describe();
  EXPECT_EQ(job.state(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(job.message(), "");
  EXPECT_EQ(job.frames().waiting(), 2);
  EXPECT_EQ(job.frames().done(), 1);
  EXPECT_EQ(life_.frames().infos()[1].attempts(), 0);
  EXPECT_LT(job.remaining_s(), 0);
  EXPECT_FALSE(life_.is_aborted());

  EXPECT_TRUE(life_.Start());
  Finish(1, v1::FRAME_STATE_DONE);
  Finish(2, v1::FRAME_STATE_DONE);
  life_.Conclude(life_.Outcome({}));
  EXPECT_EQ(life_.job().state(), v1::JOB_STATE_DONE);
  EXPECT_FALSE(life_.Retry());
}

TEST(JobLife, FollowsATakeThatGrows) {
  v1::Job spec = NewJob();
  spec.mutable_spec()->set_live_every(2);
  JobLife life(spec, {"a"});
  ASSERT_TRUE(life.following());
  life.Append({"b", "c", "d", "e", "f"});
  EXPECT_EQ(life.job().last_frame(), "f");
  EXPECT_EQ(life.Describe().live().sets_recorded(), 6);
  EXPECT_EQ(life.Describe().live().backlog(), 3);
  // Every other one, the newest first.
  EXPECT_THAT(life.frames().TakeChunk(1), ElementsAre(4, 2, 0));
  EXPECT_FALSE(life.frames().HasWaiting());
  life.frames().Start(4);
  life.frames().Finish(4, Ended("e", v1::FRAME_STATE_DONE));
  life.SetLatency(4, 1.5);
  EXPECT_EQ(life.Describe().live().latency_s(), 1.5);
  EXPECT_EQ(life.Describe().live().backlog(), 2);
  life.Append({"g"});
  EXPECT_THAT(life.frames().TakeChunk(1), ElementsAre(6));
  for (const size_t position : {0, 2, 6}) {
    life.frames().Start(position);
    life.frames().Finish(position, Ended("", position == 2 ? v1::FRAME_STATE_FAILED : v1::FRAME_STATE_DONE));
  }

  life.HoldFrames();
  life.Append({"h", "i"});
  EXPECT_FALSE(life.frames().HasWaiting());
  life.StopFollowing(true);
  EXPECT_FALSE(life.following());
  EXPECT_EQ(life.Describe().frames().waiting(), 9) << "those that are done are to be refined";
  EXPECT_EQ(life.frames().infos()[4].latency_s(), 1.5);
  EXPECT_EQ(life.frames().infos()[4].frame(), "e");
  EXPECT_EQ(life.frames().TakeChunk(1).front(), 0u);
}

TEST(JobLife, FramesThatNoneRefinesAreDoneOnce) {
  v1::Job spec = NewJob();
  spec.mutable_spec()->set_live_every(1);
  JobLife life(spec, std::vector<std::string>{"a", "b"});
  EXPECT_THAT(life.frames().TakeAll(), ElementsAre(0, 1));
  for (const size_t position : {0, 1}) {
    life.frames().Start(position);
    life.frames().Finish(position, Ended("", v1::FRAME_STATE_DONE));
  }
  life.Append({"c"});
  life.HoldFrames();
  life.StopFollowing(false);
  EXPECT_EQ(life.Describe().frames().done(), 2);
  EXPECT_THAT(life.frames().TakeAll(), ElementsAre(2));
}

TEST_F(JobLifeTest, GuessesWhatRemainsFromWhatItComputed) {
  life_.Start();
  EXPECT_LT(life_.Describe().remaining_s(), 0);
  Finish(0, v1::FRAME_STATE_DONE);
  EXPECT_GE(life_.Describe().remaining_s(), 0);
  life_.Conclude(life_.Outcome({}));
  EXPECT_EQ(life_.Describe().remaining_s(), 0);
}

TEST(JobLife, OfAJobThatHasEndedSaysSo) {
  v1::Job job = NewJob();
  job.set_state(v1::JOB_STATE_FAILED);
  const JobLife life(job, std::vector<v1::FrameInfo>{Ended("a", v1::FRAME_STATE_FAILED)});
  EXPECT_EQ(life.Describe().remaining_s(), 0);
  EXPECT_EQ(life.Describe().frames().failed(), 1);
}

}  // namespace
}  // namespace weft
