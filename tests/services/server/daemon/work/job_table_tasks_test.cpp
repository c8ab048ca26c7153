// What becomes of tasks, and of takes that grow.
#include "services/server/daemon/work/job_table.h"
#include "tests/services/server/daemon/work/table_fixture.h"

namespace weft {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class JobTableTasksTest : public TableFixture {
 protected:
  std::vector<v1::FrameState> States(const JobRef& job) const {
    std::vector<v1::FrameState> states;
    for (const v1::FrameInfo& info : job->infos()) states.push_back(info.state());
    return states;
  }
};

TEST_F(JobTableTasksTest, EventsMoveTheirFrames) {
  const JobRef job = Add(NewJob("a"), 3);
  const auto task = Begin();
  Effects();
  Tell(*task, Started("f0"));
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_RUNNING);
  EXPECT_THAT(Effects().changed.at(job), ElementsAre(0));
  Tell(*task, Advanced("f0", 0.5));
  EXPECT_EQ(job->infos()[0].share_done(), 0.5);
  JobEffects effects = Effects();
  EXPECT_THAT(effects.changed, IsEmpty()) << "a share is shown, and not written down";
  EXPECT_THAT(effects.shown, ElementsAre(job));
  Tell(*task, Advanced("f1", 0.5));
  EXPECT_EQ(StateOf(job, 1), v1::FRAME_STATE_WAITING);
  Tell(*task, Finished("f0", v1::FRAME_STATE_FAILED));
  Tell(*task, Finished("f1"));  // without a word of its start
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_FAILED);
  EXPECT_EQ(StateOf(job, 1), v1::FRAME_STATE_DONE);
  EXPECT_EQ(table_.frames_failed(), 1);
  EXPECT_EQ(table_.frames_done(), 1);
  Tell(*task, Finished("f2", v1::FRAME_STATE_WAITING));
  EXPECT_EQ(StateOf(job, 2), v1::FRAME_STATE_RUNNING) << "no result";
}

TEST_F(JobTableTasksTest, WhatAWorkerSaysOfOthersFramesIsNotHeard) {
  shape_.most_frames = 1;
  const JobRef job = Add(NewJob("a"), 2);
  const auto task = Begin();
  Tell(*task, Finished("f0"));
  Effects();
  for (const char* frame : {"f0", "f1", "f9"}) {
    Tell(*task, Finished(frame, v1::FRAME_STATE_FAILED));
    const JobEffects effects = Effects();
    EXPECT_THAT(effects.changed, IsEmpty());
    ASSERT_THAT(effects.log, SizeIs(1));
    EXPECT_THAT(effects.log[0].second, HasSubstr("is not its own"));
  }
  table_.OnEvent("unknown", Finished("f1"), 0);
  EXPECT_THAT(States(job), ElementsAre(v1::FRAME_STATE_DONE, v1::FRAME_STATE_WAITING));
}

TEST_F(JobTableTasksTest, UsageAndTimesOfTasksAreSummedUp) {
  const JobRef job = Add(NewJob("a"), 1);
  const auto task = Begin();
  v1::WorkerEvent used;
  used.mutable_usage()->set_core_s(3);
  Tell(*task, used);
  v1::WorkerEvent began;
  began.mutable_began();
  Tell(*task, began);
  FinishFrames(*task);
  End(*task, {.clean = true, .queued_s = 2});
  End(*task);  // no task of this name any more
  EXPECT_EQ(job->job().usage().tasks(), 1);
  EXPECT_EQ(job->job().usage().queued_s(), 2);
  EXPECT_EQ(job->job().usage().core_s(), 3);
}

TEST_F(JobTableTasksTest, AWorkerThatCrashesIsTheFaultOfTheFrameItWasAt) {
  const JobRef job = Add(NewJob("a"), 3);
  for (int attempt = 1; attempt <= kMaxAttempts; ++attempt) {
    auto task = Begin();
    ASSERT_TRUE(task);
    while (task->task.frames(0) != "f0") {  // one whose worker crashed comes last, alone
      FinishFrames(*task), End(*task);
      task = Begin();
      ASSERT_TRUE(task);
    }
    Tell(*task, Started("f0"));
    Effects();
    End(*task, {.reason = "killed by signal 11"});
  }
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_FAILED);
  EXPECT_THAT(job->infos()[0].reason(), HasSubstr("ended abnormally 3 times; last: killed by signal 11"));
  const JobEffects effects = Effects();
  ASSERT_THAT(effects.quarantined, SizeIs(1));
  EXPECT_EQ(effects.quarantined[0].frame.frame(), "f0");
  EXPECT_TRUE(effects.changed.at(job).contains(0));
  EXPECT_EQ(StateOf(job, 1), v1::FRAME_STATE_DONE);
}

TEST_F(JobTableTasksTest, AWorkerThatEndsBetweenFramesIsTheFaultOfTheNext) {
  const JobRef job = Add(NewJob("a"), 3);
  const auto task = Begin();
  Tell(*task, Finished("f0"));
  End(*task, {.clean = true});
  EXPECT_EQ(job->infos()[1].attempts(), 1);
  EXPECT_EQ(job->infos()[2].attempts(), 0);
}

TEST_F(JobTableTasksTest, WorkersThatNeverBeginEndTheJob) {
  const JobRef job = Add(NewJob("a"), 2);
  for (int start = 0; start < kMaxAttempts; ++start) {
    EXPECT_FALSE(job->life.is_aborted());
    const auto task = Begin();
    ASSERT_TRUE(task);
    End(*task, {.reason = "no such program"});
  }
  EXPECT_TRUE(job->life.is_aborted());
  EXPECT_THAT(States(job), Each(v1::FRAME_STATE_CANCELLED));
  EXPECT_THAT(job->job().message(), HasSubstr("its workers end before they begin: no such program"));
}

TEST_F(JobTableTasksTest, OneThatBeganForgivesThoseThatDidNot) {
  const JobRef job = Add(NewJob("a"), 5);
  for (int round = 0; round < 2; ++round) {
    for (int start = 1; start < kMaxAttempts; ++start) End(*Begin(), {.reason = "no such program"});
    const auto task = Begin();
    ASSERT_TRUE(task);
    Tell(*task, Finished(task->task.frames(0)));
    End(*task, {.reason = "stopped", .lost = true});
  }
  EXPECT_FALSE(job->life.is_aborted());
}

TEST_F(JobTableTasksTest, LackOfRoomIsNobodysFault) {
  const struct {
    std::optional<v1::WorkerEvent> error;
    TaskEnd end;
  } ends[] = {
      {std::nullopt, {.reason = "no disk for its files", .refused = true}},
      {Error("RESOURCE_EXHAUSTED", "voll", v1::ERROR_REASON_DISK_FULL), {.reason = "exit 4"}},
      {Error("RESOURCE_EXHAUSTED", "keiner", v1::ERROR_REASON_NO_FREE_THREAD), {.reason = "exit 4"}},
      {std::nullopt, {.reason = "its last output: fork: Resource temporarily unavailable"}},
  };
  for (const auto& [error, end] : ends) {
    const JobRef job = Add(NewJob("a"), 2);
    const auto task = Begin();
    ASSERT_TRUE(task);
    Tell(*task, Started("f0"));
    if (error) Tell(*task, *error);
    End(*task, end);
    EXPECT_FALSE(job->life.is_aborted()) << end.reason;
    EXPECT_THAT(States(job), Each(v1::FRAME_STATE_WAITING)) << end.reason;
    EXPECT_EQ(job->infos()[0].attempts(), 0) << end.reason;
    EXPECT_TRUE(job->start_again) << end.reason;
    EXPECT_FALSE(Begin()) << end.reason;
    table_.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
    EXPECT_TRUE(job->finishing) << "cancelled ones do not wait for room";
    Conclude(job);
    table_.Forget(job);
  }
}

TEST_F(JobTableTasksTest, OtherErrorsOfAWorkerEndTheJob) {
  const JobRef job = Add(NewJob("a"), 2);
  auto task = Begin();
  Tell(*task, Error("CANCELLED", "somebody sent SIGTERM"));
  End(*task, {.reason = "exit 1"});
  EXPECT_FALSE(job->life.is_aborted()) << "which is no reason to give up";
  task = Begin();
  ASSERT_TRUE(task);
  Tell(*task, Error("RESOURCE_EXHAUSTED", "the task takes more than 100 MiB"));
  End(*task, {.reason = "exit 1"});
  EXPECT_TRUE(job->life.is_aborted());
  EXPECT_THAT(job->job().message(), HasSubstr("more than 100 MiB"));
  EXPECT_THAT(States(job), Each(v1::FRAME_STATE_CANCELLED));
}

TEST_F(JobTableTasksTest, LostMachinesAreNotedAndTheirFramesDoneAgain) {
  const JobRef job = Add(NewJob("a"), 2);
  auto task = Begin();
  Tell(*task, Started("f0"));
  End(*task, {.reason = "node 7 failed", .lost = true});
  EXPECT_EQ(job->infos()[0].attempts(), 0);
  EXPECT_THAT(job->job().warnings(), ElementsAre("2 frames are registered again: node 7 failed"));
  EXPECT_EQ(job->job().usage().tasks_lost(), 1);
  for (int i = 0; i < 60; ++i) {
    task = Begin();
    ASSERT_TRUE(task);
    End(*task, {.reason = "node 7 failed", .lost = true});
  }
  ASSERT_THAT(job->job().warnings(), SizeIs(50)) << "and no more";
  EXPECT_EQ(job->job().warnings(49), "more about its tasks is in the log of weftd");
}

TEST_F(JobTableTasksTest, ATaskThatCannotBeStartedGivesItsFramesBack) {
  const JobRef job = Add(NewJob("a"), 2);
  EXPECT_FALSE(Next());
  table_.OnFolderTaken(job, absl::OkStatus(), now_);
  const auto task = Next();
  table_.CouldNotBegin(*task, "no slot", now_);
  table_.CouldNotBegin(*task, "no slot", now_);
  table_.Began(*task, "", now_);  // it is gone
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_QUEUED);
  EXPECT_THAT(States(job), Each(v1::FRAME_STATE_WAITING));
  EXPECT_FALSE(Begin()) << "not again and again";
  EXPECT_THAT(job->job().message(), HasSubstr("no slot"));
  Pass(std::chrono::seconds(1));
  table_.DoWhatIsDue(now_);
  EXPECT_TRUE(Begin());
}

TEST_F(JobTableTasksTest, SaysWhyATaskWaits) {
  const JobRef job = Add(NewJob("a"), 1);
  const auto task = Begin();
  table_.OnTaskWaits(task->task.id(), "the partition is full");
  EXPECT_EQ(job->job().message(), "the partition is full");
  Effects();
  table_.OnTaskWaits(task->task.id(), "the partition is full");
  EXPECT_THAT(Effects().changed, IsEmpty()) << "the same again";
  table_.OnTaskNoted(task->task.id(), "node 3 is slow");
  EXPECT_THAT(job->job().warnings(), ElementsAre("node 3 is slow"));
  Tell(*task, Finished("f0"));
  EXPECT_EQ(job->job().message(), "");
  table_.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
  table_.OnTaskWaits(task->task.id(), "the partition is full");
  EXPECT_EQ(job->job().message(), "being cancelled");
  table_.OnTaskWaits("unknown", "x");
  table_.OnTaskNoted("unknown", "x");
}

TEST_F(JobTableTasksTest, TasksOfTheDaemonBeforeRunOn) {
  const JobRef job = Add(NewJob("a"), 3);
  v1::Task task;
  task.set_id("a.7"), task.set_job_id("a");
  for (const char* frame : {"f0", "f1", "gone"}) task.add_frames(frame);
  ASSERT_TRUE(table_.TakeUp(task, "/logs", now_));
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_RUNNING);
  slots_ = 2;
  const auto next = Begin();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->task.id(), "a.8") << "no id twice";
  EXPECT_THAT(next->task.frames(), ElementsAre("f2"));
  table_.OnEvent("a.7", Finished("f0"), 0);
  Effects();
  table_.OnEvent("a.7", Finished("f0"), 0);
  EXPECT_THAT(Effects().log, IsEmpty()) << "it tells again what it told before";
  table_.OnEvent("a.7", Finished("f1"), 0);
  table_.OnTaskEnded("a.7", {.clean = true}, now_);
  EXPECT_EQ(StateOf(job, 1), v1::FRAME_STATE_DONE);
  // Nobody waits for these.
  EXPECT_FALSE(table_.TakeUp(task, "", now_)) << "its frames are done";
  task.set_job_id("unknown");
  EXPECT_FALSE(table_.TakeUp(task, "", now_));
  const JobRef aborted = Add(NewJob("b", "bert"), 3);
  table_.Abort(aborted, v1::JOB_STATE_CANCELLED, "cancelled");
  task.set_job_id("b");
  EXPECT_FALSE(table_.TakeUp(task, "", now_));
  v1::Job live = NewJob("c", "carl");
  live.mutable_spec()->set_live_every(1);
  Add(live, 3);
  task.set_job_id("c");
  EXPECT_FALSE(table_.TakeUp(task, "", now_));
}

TEST_F(JobTableTasksTest, ADrainHasWorkersStopAfterTheirFrame) {
  const JobRef job = Add(NewJob("a"), 3);
  const auto task = Begin();
  Effects();
  table_.Drain(false, false);
  EXPECT_THAT(Effects().stop_tasks, IsEmpty()) << "it begins just now";
  table_.Drain(false, true);
  EXPECT_THAT(Effects().stop_tasks, ElementsAre(task->task.id())) << "which may take long on a cluster";
  Tell(*task, Started("f0"));
  table_.Drain(false, false);
  EXPECT_THAT(Effects().stop_tasks, IsEmpty());
  EXPECT_EQ(table_.CurrentDrain().frames, 1);
  Tell(*task, Finished("f0"));
  EXPECT_THAT(Effects().stop_tasks, ElementsAre(task->task.id()));
  EXPECT_FALSE(table_.CurrentDrain().is_drained);
  End(*task, {.reason = "stopped"});
  EXPECT_EQ(job->infos()[1].attempts(), 0);
  EXPECT_FALSE(Begin());
  EXPECT_TRUE(table_.CurrentDrain().is_drained);
  EXPECT_EQ(table_.CurrentDrain().jobs, 1);
  table_.Drain(true, false);
  EXPECT_FALSE(table_.CurrentDrain().is_drained) << "jobs end first";
  FinishAll(job);
  Conclude(job);
  EXPECT_TRUE(table_.CurrentDrain().is_drained);
}

TEST_F(JobTableTasksTest, TheEndOfTheDaemonCountsAgainstNoFrame) {
  const JobRef job = Add(NewJob("a"), 2);
  const auto task = Begin();
  Tell(*task, Started("f0"));
  table_.Stop();
  Tell(*task, Error("INTERNAL", "its pipe broke"));
  End(*task, {.reason = "killed"});
  EXPECT_FALSE(job->life.is_aborted());
  EXPECT_EQ(job->infos()[0].attempts(), 0);
  EXPECT_FALSE(Begin());
}

class LiveTableTest : public TableFixture {
 protected:
  LiveTableTest() {
    v1::Job job = NewJob("a");
    job.mutable_spec()->set_live_every(1);
    job_ = Add(job, 0);
  }
  void See(int sets, bool closed, bool is_settled = true, int64_t host_time_ns = 0) {
    progress_.sets.resize(static_cast<size_t>(sets));
    for (int i = 0; i < sets; ++i) progress_.sets[static_cast<size_t>(i)].number = static_cast<uint64_t>(i);
    progress_.closed = closed;
    table_.OnTakeSeen(job_, is_settled, &progress_, host_time_ns, now_);
  }

  JobRef job_;
  TakeProgress progress_;
};

TEST_F(LiveTableTest, LooksAtItsTakeUntilThatIsClosed) {
  EXPECT_EQ(table_.NextDue(), now_);
  Effects();
  table_.DoWhatIsDue(now_);
  EXPECT_THAT(FilesOf(job_), ElementsAre(Files::kLookAtTake));
  EXPECT_FALSE(table_.NextDue());
  See(0, false, false);
  EXPECT_THAT(job_->job().message(), HasSubstr("whose recorder died, is recovered"));
  EXPECT_FALSE(Begin());
  ASSERT_TRUE(table_.NextDue());
  See(2, false);
  EXPECT_EQ(job_->job().message(), "");
  EXPECT_EQ(job_->infos().size(), 2u);
  EXPECT_THAT(Effects().changed.at(job_), ElementsAre(0, 1));
  const auto task = Begin();
  ASSERT_TRUE(task);
  EXPECT_TRUE(task->task.spec().options().frames_alone());
  FinishFrames(*task);
  See(3, true);
  EXPECT_TRUE(job_->life.following()) << "while a task runs";
  End(*task);
  EXPECT_FALSE(job_->life.following());
  EXPECT_THAT(Effects().changed.at(job_), ElementsAre(0, 1, 2));
  EXPECT_EQ(StateOf(job_, 0), v1::FRAME_STATE_WAITING) << "to be refined";
  FinishAll(job_);
  EXPECT_TRUE(job_->checking);
}

TEST_F(LiveTableTest, TellsTheTimeFromRecordingToMesh) {
  progress_.sets.resize(1);
  progress_.sets[0].host_time_ns = 1'000'000'000;
  See(1, false);
  const auto task = Begin();
  ASSERT_TRUE(task);
  Tell(*task, Finished(task->task.frames(0)), 3'500'000'000);
  EXPECT_EQ(job_->infos()[0].latency_s(), 2.5);
}

TEST_F(LiveTableTest, SaysThatNothingComes) {
  progress_.sets.resize(1);
  progress_.sets[0].host_time_ns = 0;
  See(1, false, true, 9'000'000'000);
  EXPECT_EQ(job_->job().message(), "");
  See(1, false, true, 11'000'000'000);
  EXPECT_THAT(job_->job().message(), HasSubstr("no frame set came for 10 s"));
  EXPECT_THAT(job_->job().message(), HasSubstr("weft take recover /takes/a"));
}

TEST_F(LiveTableTest, ATakeThatCannotBeReadEndsTheJob) {
  table_.OnTakeSeen(job_, true, absl::DataLossError("the ledger is damaged"), 0, now_);
  EXPECT_TRUE(job_->life.is_aborted());
  EXPECT_TRUE(job_->finishing);
  See(5, false);
  EXPECT_THAT(job_->infos(), IsEmpty()) << "it ends";
  table_.OnFinished(job_, table_.Outcome(job_, {}), absl::OkStatus(), now_);
  table_.Saved(job_);
  EXPECT_THAT(job_->job().message(), HasSubstr("the ledger is damaged"));
}

TEST_F(LiveTableTest, NothingIsFollowedWhenTheDaemonStops) {
  table_.Stop();
  See(2, false);
  EXPECT_THAT(job_->infos(), IsEmpty());
}

}  // namespace
}  // namespace weft
