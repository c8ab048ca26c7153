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

TEST(NewLocalJob, HasWhatItWasAskedAndAnIdOfItsTime) {
  v1::RegistrationSpec spec;
  spec.set_out("/results");
  v1::InputHashes inputs;
  inputs.set_rig("0123");
  const v1::Job job = NewLocalJob(spec, inputs, {"one", "two"});
  EXPECT_EQ(job.spec().out(), "/results");
  EXPECT_EQ(job.inputs().rig(), "0123");
  EXPECT_THAT(job.warnings(), ElementsAre("one", "two"));
  ASSERT_TRUE(job.id().starts_with("local-"));
  EXPECT_EQ(job.id().size(), 6u + 10);  // seconds of this century
}

TEST_F(JobLifeTest, AddsUpWhatItsTasksTook) {
  v1::WorkerUsage usage;
  usage.set_core_s(5), usage.set_wall_s(6), usage.set_peak_memory_mib(300);
  life_.AddUsage(usage);
  usage.set_core_s(1), usage.set_wall_s(2), usage.set_peak_memory_mib(200);
  life_.AddUsage(usage);
  life_.CountTask(false, 1.5);
  life_.CountTask(true, 2);
  const v1::JobUsage& all = life_.job().usage();
  EXPECT_EQ(all.core_s(), 6);
  EXPECT_EQ(all.worker_s(), 8);
  EXPECT_EQ(all.peak_memory_mib(), 300);
  EXPECT_EQ(all.tasks(), 2);
  EXPECT_EQ(all.tasks_lost(), 1);
  EXPECT_EQ(all.queued_s(), 3.5);
}

TEST_F(JobLifeTest, OnlyASpecThatSaysSoFollowsItsTake) {
  EXPECT_FALSE(life_.following());
  EXPECT_FALSE(life_.Describe().has_live());
  EXPECT_THAT(life_.frames().TakeAll(), ElementsAre(0, 1, 2));
}

TEST_F(JobLifeTest, TimesAreThoseOfItsStart) {
  EXPECT_EQ(life_.job().started_unix_ns(), 0);
  EXPECT_FALSE(life_.job().weft_version().empty());
  life_.Start();
  EXPECT_GE(life_.job().started_unix_ns(), life_.job().created_unix_ns());
}

TEST_F(JobLifeTest, GuessesFromAFifthOfAFrameOn) {
  life_.Start();
  life_.frames().Start(0);
  life_.frames().Advance(0, 0.19);
  EXPECT_EQ(life_.Describe().remaining_s(), -1);
  life_.frames().Advance(0, 0.2);
  EXPECT_GE(life_.Describe().remaining_s(), 0);
}

TEST_F(JobLifeTest, NamesAllFramesWhoseInputsChanged) {
  for (size_t i = 0; i < 3; ++i) Finish(i, v1::FRAME_STATE_DONE);
  ASSERT_TRUE(life_.DoAgain({{0, "its images changed", true}, {2, "its scan changed", true}}).ok());
  ASSERT_EQ(life_.job().warnings_size(), 1);
  EXPECT_THAT(life_.job().warnings(0), HasSubstr("these frames were registered again"));
  Finish(1, v1::FRAME_STATE_DONE);
  ASSERT_TRUE(life_.DoAgain({{1, "mesh.ply is missing", false}}).ok());
  EXPECT_EQ(life_.job().warnings_size(), 1);
}

TEST_F(JobLifeTest, FramesWithoutAResultHaveNoReasonWhereTheJobHasNone) {
  Finish(0, v1::FRAME_STATE_DONE);
  EXPECT_EQ(life_.Outcome({}).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(life_.frames().infos()[1].state(), v1::FRAME_STATE_CANCELLED);
  EXPECT_EQ(life_.frames().infos()[1].reason(), "");
}

TEST_F(JobLifeTest, ARetryBeginsAnew) {
  life_.Start();
  Finish(0, v1::FRAME_STATE_FAILED, "dark");
  for (int i = 0; i < kMaxRepairs; ++i) ASSERT_TRUE(life_.DoAgain({{1, "mesh.ply is missing"}}).ok());
  life_.Abort(v1::JOB_STATE_FAILED, "the disk\nis full");
  EXPECT_EQ(life_.abort_message(), life_.job().ends_because());
  EXPECT_EQ(life_.abort_message().find('\n'), std::string::npos);
  v1::Job ended = life_.Outcome({});
  EXPECT_EQ(ended.state(), v1::JOB_STATE_FAILED);
  ended.mutable_verdict()->set_grade(v1::GRADE_BAD);
  life_.Conclude(ended);
  ASSERT_TRUE(life_.Retry());
  EXPECT_EQ(life_.job().started_unix_ns(), 0);
  EXPECT_EQ(life_.job().finished_unix_ns(), 0);
  EXPECT_FALSE(life_.job().has_verdict());
  EXPECT_TRUE(life_.DoAgain({{1, "mesh.ply is missing"}}).ok());
  EXPECT_FALSE(life_.Retry()) << "it has not ended";
}

TEST(JobLife, GoesOnAsItWasWrittenDown) {
  for (const v1::JobState state : {v1::JOB_STATE_DONE, v1::JOB_STATE_FAILED, v1::JOB_STATE_CANCELLED,
                                   v1::JOB_STATE_QUEUED, v1::JOB_STATE_RUNNING}) {
    v1::Job job = NewJob();
    job.set_state(state);
    job.set_ends_as(v1::JOB_STATE_CANCELLED);
    job.set_ends_because("cancelled");
    JobLife life(job, std::vector<v1::FrameInfo>{Ended("a", v1::FRAME_STATE_FAILED)});
    const bool has_ended = state != v1::JOB_STATE_QUEUED && state != v1::JOB_STATE_RUNNING;
    EXPECT_EQ(life.is_aborted(), !has_ended);
    EXPECT_EQ(life.Describe().remaining_s(), has_ended ? 0 : -1);
    EXPECT_EQ(life.Retry(), has_ended);
  }
}

TEST(JobLife, AFollowedTakeMayBeginWithoutFrames) {
  v1::Job spec = NewJob();
  spec.mutable_spec()->set_live_every(2);
  JobLife life(spec, std::vector<std::string>{});
  EXPECT_EQ(life.job().first_frame(), "");
  life.Append({});
  EXPECT_EQ(life.job().last_frame(), "");
  life.Append({"a", "b"});
  life.Append({"c"});
  EXPECT_EQ(life.job().first_frame(), "a");
  EXPECT_EQ(life.job().last_frame(), "c");
  v1::FrameInfo seen = Ended("a", v1::FRAME_STATE_DONE);
  seen.set_coverage(0.75);
  life.frames().Finish(0, seen);
  life.SetLatency(0, 1.25);
  EXPECT_EQ(life.job().live().coverage(), 0.75);
  EXPECT_EQ(life.frames().infos()[0].latency_s(), 1.25);

  // One that was written down goes on following, and a retry does, too.
  JobLife again(life.Describe(), life.frames().infos());
  EXPECT_THAT(again.frames().TakeAll(), ElementsAre(2));
  again.Conclude(again.Outcome({}));
  EXPECT_TRUE(again.Retry());
  EXPECT_THAT(again.frames().TakeAll(), ElementsAre(2));
  again.StopFollowing(false);
  EXPECT_EQ(again.job().live().sets_recorded(), 3);
  EXPECT_EQ(again.job().live().backlog(), 0);
  EXPECT_FALSE(again.following());
}

TEST(JobLife, ATakeThatIsFollowedMayBeRetriedWithoutAFailure) {
  v1::Job spec = NewJob();
  spec.mutable_spec()->set_live_every(1);
  JobLife life(spec, std::vector<std::string>{"a"});
  life.frames().Finish(0, Ended("a", v1::FRAME_STATE_DONE));
  life.Conclude(life.Outcome({}));
  EXPECT_TRUE(life.Retry());
}

TEST(JobLife, FramesThatKilledTheirWorkersAreNotRefined) {
  v1::Job spec = NewJob();
  spec.mutable_spec()->set_live_every(1);
  JobLife life(spec, std::vector<std::string>{"a", "b", "c", "d"});
  const auto end = [&](size_t position, int attempts, v1::FrameState state) {
    for (int i = 0; i < attempts; ++i) life.frames().Start(position);
    life.frames().Finish(position, Ended("", state));
  };
  end(0, kMaxAttempts, v1::FRAME_STATE_FAILED);
  end(1, kMaxAttempts - 1, v1::FRAME_STATE_FAILED);
  end(2, kMaxAttempts, v1::FRAME_STATE_DONE);
  life.frames().Start(3);
  life.StopFollowing(true);
  EXPECT_EQ(life.frames().infos()[0].state(), v1::FRAME_STATE_FAILED);
  EXPECT_EQ(life.frames().infos()[1].state(), v1::FRAME_STATE_WAITING);
  EXPECT_EQ(life.frames().infos()[2].state(), v1::FRAME_STATE_WAITING);
  EXPECT_EQ(life.frames().infos()[3].state(), v1::FRAME_STATE_RUNNING);
}

}  // namespace
}  // namespace weft
