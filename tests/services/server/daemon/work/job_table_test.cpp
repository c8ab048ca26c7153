// What a job goes through, and whose turn it is.
#include "services/server/daemon/work/job_table.h"

#include "tests/services/server/daemon/work/table_fixture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class JobTableTest : public TableFixture {};

TEST_F(JobTableTest, AReservedJobCountsAndIsNotSeen) {
  const auto reserved = table_.Reserve(JobLife(NewJob("a"), Names(2)), v1::ROLE_CLIENT);
  ASSERT_TRUE(reserved.ok());
  EXPECT_EQ(table_.Find("a"), nullptr);
  EXPECT_FALSE(Begin());
  EXPECT_THAT(FilesOf(*reserved), IsEmpty());
  v1::Job other = NewJob("b");
  other.mutable_spec()->set_out("/results/a");
  EXPECT_EQ(table_.Reserve(JobLife(other, Names(1)), v1::ROLE_CLIENT).status().code(),
            absl::StatusCode::kFailedPrecondition);
  table_.Forget(*reserved);
  EXPECT_TRUE(table_.Reserve(JobLife(other, Names(1)), v1::ROLE_CLIENT).ok());
}

TEST_F(JobTableTest, RefusesWhatIsTooMuchOfOneCallerOrGoesIntoAnothersResults) {
  for (const char* id : {"a", "b", "c"}) ASSERT_NE(Add(NewJob(id)), nullptr);
  EXPECT_EQ(table_.Reserve(JobLife(NewJob("d"), Names(1)), v1::ROLE_CLIENT).status().code(),
            absl::StatusCode::kResourceExhausted);
  v1::Job below = NewJob("e", "bert");
  below.mutable_spec()->set_out("/results/a/further");
  const absl::Status status = table_.Reserve(JobLife(below, Names(1)), v1::ROLE_CLIENT).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("job a"));
  // Where somebody's own results lie is their own affair, and ended jobs hold nothing.
  table_.Abort(table_.Find("a"), v1::JOB_STATE_CANCELLED, "cancelled");
  Conclude(table_.Find("a"));
  EXPECT_TRUE(table_.Reserve(JobLife(below, Names(1)), v1::ROLE_CLIENT).ok());
  table_.Stop();
  EXPECT_EQ(table_.Reserve(JobLife(NewJob("f", "carl"), Names(1)), v1::ROLE_CLIENT).status().code(),
            absl::StatusCode::kUnavailable);
}

TEST_F(JobTableTest, GoesFromItsFolderThroughTasksAndTheCheckToItsEnd) {
  const JobRef job = Add(NewJob("a"), 2);
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_QUEUED);
  Effects();
  EXPECT_FALSE(Next());
  EXPECT_THAT(FilesOf(job), ElementsAre(Files::kTakeFolder));
  EXPECT_FALSE(Next()) << "while its folder is taken";
  EXPECT_THAT(FilesOf(job), IsEmpty());
  table_.OnFolderTaken(job, absl::OkStatus(), now_);
  const auto task = Next();
  ASSERT_TRUE(task);
  EXPECT_EQ(task->task.job_id(), "a");
  EXPECT_EQ(task->task.id(), "a.1");
  EXPECT_THAT(task->task.frames(), ElementsAre("f0", "f1"));
  table_.Began(*task, "/logs/a", now_);
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_RUNNING);
  EXPECT_EQ(job->job().task_logs(), "/logs/a");
  FinishFrames(*task);
  EXPECT_THAT(FilesOf(job), IsEmpty()) << "while its task runs";
  End(*task);
  EXPECT_THAT(FilesOf(job), ElementsAre(Files::kCheck));
  table_.OnChecked(job, std::vector<IncompleteFrame>{}, now_);
  EXPECT_TRUE(job->checked);
  EXPECT_THAT(FilesOf(job), ElementsAre(Files::kFinish));
  table_.OnFinished(job, table_.Outcome(job, {}), absl::OkStatus(), now_);
  EXPECT_THAT(Effects().concluded, ElementsAre(job));
  EXPECT_FALSE(job->ended) << "before it is written down";
  table_.CouldNotSave(job, "the disk is full");
  EXPECT_THAT(job->job().message(), HasSubstr("cannot be written down yet: the disk is full"));
  table_.Saved(job);
  EXPECT_TRUE(job->ended);
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_DONE);
  table_.Saved(job);  // twice changes nothing
  EXPECT_EQ(table_.frames_done(), 2);
}

TEST_F(JobTableTest, FoldersAreTakenAnewForEachRoundAndKeepASlot) {
  const JobRef first = Add(NewJob("a"), 1), second = Add(NewJob("b", "bert"), 1);
  Effects();
  EXPECT_FALSE(Next());
  const JobEffects effects = Effects();
  ASSERT_THAT(effects.files, SizeIs(1)) << "one slot, one folder";
  EXPECT_EQ(effects.files[0].first, first);
  table_.OnFolderTaken(first, absl::OkStatus(), now_);
  table_.EndRound();
  EXPECT_FALSE(Next()) << "it is taken again";
  EXPECT_THAT(FilesOf(first), ElementsAre(Files::kTakeFolder));
  slots_ = 2;
  EXPECT_FALSE(Next());
  EXPECT_THAT(FilesOf(second), ElementsAre(Files::kTakeFolder));
  table_.OnFolderTaken(second, absl::OkStatus(), now_);
  EXPECT_EQ(Next()->job, second) << "the one whose folder is there";
}

TEST_F(JobTableTest, AFolderThatCannotBeTakenEndsOrDelaysItsJob) {
  const JobRef full = Add(NewJob("a")), lost = Add(NewJob("b"));
  slots_ = 2;
  EXPECT_FALSE(Next());
  table_.OnFolderTaken(full, absl::ResourceExhaustedError("no room"), now_);
  EXPECT_THAT(full->job().message(), HasSubstr("waits until there is room: no room"));
  table_.OnFolderTaken(lost, absl::FailedPreconditionError("in use"), now_);
  EXPECT_TRUE(lost->life.is_aborted());
  EXPECT_THAT(lost->job().message(), HasSubstr("in use"));
  EXPECT_FALSE(Next());
  ASSERT_EQ(table_.NextDue(), now_ + std::chrono::seconds(1));
  Effects();
  table_.DoWhatIsDue(now_);
  EXPECT_FALSE(Next());
  Pass(std::chrono::seconds(1));
  table_.DoWhatIsDue(now_);
  EXPECT_FALSE(Next());
  EXPECT_THAT(FilesOf(full), ElementsAre(Files::kTakeFolder));
  table_.OnFolderTaken(full, absl::ResourceExhaustedError("no room"), now_);
  EXPECT_EQ(table_.NextDue(), now_ + std::chrono::seconds(2)) << "longer each time";
  for (int i = 0; i < 10; ++i) {
    Pass(std::chrono::seconds(40));
    table_.DoWhatIsDue(now_);
    EXPECT_FALSE(Next());
    table_.OnFolderTaken(full, absl::ResourceExhaustedError("no room"), now_);
  }
  EXPECT_EQ(table_.NextDue(), now_ + std::chrono::seconds(30)) << "but not for ever";
}

TEST_F(JobTableTest, CallersTakeTurnsWithinAClassOfPriorities) {
  shape_.most_frames = 1;
  Add(NewJob("a")), Add(NewJob("b")), Add(NewJob("c", "bert"));
  std::vector<std::string> order;
  for (int i = 0; i < 4; ++i) {
    const auto task = Begin();
    ASSERT_TRUE(task);
    order.push_back(task->task.job_id());
    Pass(std::chrono::seconds(1));
    FinishFrames(*task);
    End(*task);
  }
  EXPECT_THAT(order, ElementsAre("a", "c", "a", "c"));
  table_.SetPriority(table_.Find("b"), 1);
  const auto task = Begin();
  EXPECT_EQ(task->task.job_id(), "b") << "of one caller the higher one";
  FinishFrames(*task), End(*task);
  table_.SetPriority(table_.Find("c"), 50);
  for (int i = 0; i < 2; ++i) {
    const auto urgent = Begin();
    EXPECT_EQ(urgent->task.job_id(), "c") << "a higher class goes first";
    FinishFrames(*urgent), End(*urgent);
  }
}

TEST_F(JobTableTest, PrioritiesKeepTheOrderOfAge) {
  const JobRef a = Add(NewJob("a")), b = Add(NewJob("b")), c = Add(NewJob("c"));
  table_.SetPriority(a, 5);
  table_.SetPriority(c, 5);
  table_.SetPriority(b, 5);
  EXPECT_THAT(table_.jobs(), ElementsAre(a, b, c));
  table_.SetPriority(a, -5);
  EXPECT_THAT(table_.jobs(), ElementsAre(b, c, a));
  EXPECT_EQ(a->job().priority(), -5);
}

TEST_F(JobTableTest, FramesThatFollowEachOtherAreOneTaskAtATime) {
  v1::Job driven = NewJob("a");
  driven.mutable_spec()->mutable_driving()->set_avatar("/avatar");
  const JobRef job = Add(driven, 30);
  slots_ = 4, shape_.parallel = 4;
  const auto task = Begin();
  ASSERT_TRUE(task);
  EXPECT_THAT(task->task.frames(), SizeIs(30));
  Tell(*task, Finished("f0"));
  EXPECT_FALSE(Begin());
  End(*task, {.reason = "killed"});
  const auto again = Begin();
  ASSERT_TRUE(again);
  EXPECT_THAT(again->task.frames(), SizeIs(29));
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_DONE);
}

TEST_F(JobTableTest, ResultsThatAreNotThereAreComputedAgain) {
  const JobRef job = Add(NewJob("a"), 2);
  FinishAll(job);
  Effects();
  table_.OnChecked(job, std::vector<IncompleteFrame>{{1, "mesh.ply is missing", false}}, now_);
  EXPECT_EQ(StateOf(job, 1), v1::FRAME_STATE_WAITING);
  EXPECT_FALSE(job->checked);
  const JobEffects effects = Effects();
  EXPECT_THAT(effects.changed.at(job), ElementsAre(1));
  EXPECT_THAT(effects.files, IsEmpty());
  for (int repair = 1; repair <= kMaxRepairs; ++repair) {
    FinishAll(job);
    ASSERT_TRUE(job->checking);
    table_.OnChecked(job, std::vector<IncompleteFrame>{{1, "mesh.ply is missing", false}}, now_);
  }
  EXPECT_TRUE(job->life.is_aborted()) << "too often";
  EXPECT_TRUE(job->finishing);
}

TEST_F(JobTableTest, ACheckThatFailsEndsOrDelaysItsJob) {
  const JobRef job = Add(NewJob("a"), 1);
  FinishAll(job);
  table_.OnChecked(job, absl::ResourceExhaustedError("no room"), now_);
  EXPECT_FALSE(job->checking);
  Effects();
  Pass(std::chrono::seconds(1));
  table_.DoWhatIsDue(now_);
  EXPECT_THAT(FilesOf(job), ElementsAre(Files::kCheck));
  table_.OnChecked(job, absl::PermissionDeniedError("not ours"), now_);
  EXPECT_TRUE(job->life.is_aborted());
  EXPECT_THAT(FilesOf(job), ElementsAre(Files::kFinish));
  table_.OnFinished(job, table_.Outcome(job, {}), absl::ResourceExhaustedError("no room"), now_);
  EXPECT_FALSE(job->finishing);
  Pass(std::chrono::seconds(2));
  table_.DoWhatIsDue(now_);
  EXPECT_THAT(FilesOf(job), ElementsAre(Files::kFinish));
  table_.OnFinished(job, table_.Outcome(job, {}), absl::InternalError("no report"), now_);
  table_.Saved(job);
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job->job().warnings(), ElementsAre("no report"));
}

TEST_F(JobTableTest, AtTheEndOfTheDaemonNoRoomIsAWarning) {
  const JobRef job = Add(NewJob("a"), 1);
  FinishAll(job);
  table_.OnChecked(job, std::vector<IncompleteFrame>{}, now_);
  table_.Stop();
  table_.OnFinished(job, table_.Outcome(job, {}), absl::ResourceExhaustedError("no room"), now_);
  EXPECT_THAT(Effects().concluded, ElementsAre(job));
}

TEST_F(JobTableTest, AbortEndsAJobThatWaitsAtOnce) {
  const JobRef job = Add(NewJob("a"));
  Effects();
  table_.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
  EXPECT_EQ(job->job().message(), "being cancelled");
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_CANCELLED);
  const JobEffects effects = Effects();
  EXPECT_TRUE(effects.changed.contains(job));
  ASSERT_THAT(effects.files, SizeIs(1));
  EXPECT_EQ(effects.files[0].second, Files::kFinish) << "nothing to check";
  table_.Abort(job, v1::JOB_STATE_FAILED, "another reason");
  table_.OnFinished(job, table_.Outcome(job, {}), absl::OkStatus(), now_);
  table_.Saved(job);
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_CANCELLED);
  table_.Abort(job, v1::JOB_STATE_FAILED, "ended already");
  EXPECT_EQ(job->job().state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(JobTableTest, AnOutcomeStaysWhatIsWrittenDown) {
  const JobRef job = Add(NewJob("a"), 1);
  FinishAll(job);
  table_.OnChecked(job, std::vector<IncompleteFrame>{}, now_);
  EXPECT_EQ(job->LastState().state(), v1::JOB_STATE_RUNNING);
  table_.OnFinished(job, table_.Outcome(job, {}), absl::OkStatus(), now_);
  Effects();
  table_.SetPriority(job, 5);  // before its end is on the disk
  EXPECT_TRUE(Effects().changed.contains(job));
  EXPECT_EQ(job->LastState().state(), v1::JOB_STATE_DONE);
}

TEST_F(JobTableTest, AFolderThatComesAfterTheAbortChangesNothing) {
  for (const absl::Status& status : {absl::OkStatus(), absl::ResourceExhaustedError("no room")}) {
    const JobRef job = Add(NewJob("a"));
    EXPECT_FALSE(Next());
    table_.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
    table_.OnFolderTaken(job, status, now_);
    EXPECT_EQ(job->job().message(), "being cancelled");
    EXPECT_FALSE(job->start_again);
    EXPECT_FALSE(job->taking_folder || job->has_folder);
    Conclude(job);
    table_.Forget(job);
  }
}

TEST_F(JobTableTest, AbortStopsTasksAndEndsWhenTheyHaveEnded) {
  shape_.most_frames = 2;
  const JobRef job = Add(NewJob("a"), 4);
  const auto task = Begin();
  Tell(*task, Started("f0"));
  Effects();
  table_.Abort(job, v1::JOB_STATE_FAILED, "its disk is gone");
  EXPECT_THAT(Effects().stop_tasks, ElementsAre(task->task.id()));
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_RUNNING);
  EXPECT_EQ(StateOf(job, 3), v1::FRAME_STATE_CANCELLED);
  EXPECT_FALSE(Begin());
  Tell(*task, Error("CANCELLED", "stopped"));
  End(*task, {.reason = "stopped"});
  EXPECT_EQ(StateOf(job, 0), v1::FRAME_STATE_CANCELLED);
  EXPECT_EQ(job->infos()[0].reason(), "its disk is gone");
  EXPECT_TRUE(job->finishing);
}

TEST_F(JobTableTest, GoesOnAfterTheDaemonBeforeItWasKilled) {
  JobLife life(NewJob("a"), Names(3));
  life.Start();
  life.frames().TakeChunk(1);
  life.frames().Start(0);
  v1::FrameInfo done;
  done.set_frame("f0"), done.set_state(v1::FRAME_STATE_DONE);
  life.frames().Finish(0, done);
  life.frames().Start(1);
  const JobRef job = table_.Resume(JobLife(life.job(), life.frames().infos()), now_);
  EXPECT_EQ(StateOf(job, 1), v1::FRAME_STATE_WAITING);
  EXPECT_EQ(job->infos()[1].attempts(), 0) << "the daemon's end is no fault of the frame";
  const JobEffects effects = Effects();
  EXPECT_TRUE(effects.changed.at(job).contains(1));
  ASSERT_THAT(effects.files, SizeIs(1));
  EXPECT_EQ(effects.files[0].second, Files::kCheck);
  EXPECT_FALSE(Begin()) << "before its results were looked at";
  table_.OnChecked(job, std::vector<IncompleteFrame>{}, now_);
  EXPECT_FALSE(job->checked);
  EXPECT_THAT(Begin()->task.frames(), ElementsAre("f2")) << "the one that ran comes last, alone";
}

TEST_F(JobTableTest, SaysInTheLogWhatBecomesOfJobs) {
  std::vector<std::string> said;
  const auto hear = [&] {
    for (const auto& [level, text] : Effects().log)
      said.push_back(std::to_string(static_cast<int>(level)) + " " + text);
  };
  const JobRef job = Add(NewJob("a"), 3);
  auto task = Begin();
  Tell(*task, Finished("f0"));
  End(*task, {.reason = "node 7 failed", .lost = true});
  hear();
  task = Begin();
  table_.OnTaskWaits(task->task.id(), "the partition is full");
  End(*task, {.reason = "killed"});
  EXPECT_FALSE(Next());
  hear();
  table_.OnFolderTaken(job, absl::OkStatus(), now_);
  task = Next();
  ASSERT_TRUE(task);
  table_.CouldNotBegin(*task, "no slot", now_);
  table_.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
  Conclude(job);
  JobLife life(NewJob("b"), Names(2));
  table_.Resume(std::move(life), now_);
  hear();
  EXPECT_THAT(said, ::testing::IsSupersetOf(
                        {"0 task a.1: 3 frames from f0", "0 job a: frame f0 FRAME_STATE_DONE ",
                         "2 job a: 2 frames are registered again: node 7 failed",
                         "1 job a: the partition is full", "2 job a: a worker ended abnormally: killed",
                         "3 task a.3 cannot be started: no slot", "2 job a waits 1 s: no slot",
                         "1 job a ends early: cancelled", "1 job b is resumed: 2 frames left"}));
  EXPECT_THAT(said, ::testing::Contains(HasSubstr("1 job a: JOB_STATE_CANCELLED ")));
}

TEST_F(JobTableTest, AJobThatWasAbortedIsNotTakenUp) {
  JobLife life(NewJob("a"), Names(2));
  life.Start();
  life.frames().TakeChunk(1);
  life.frames().Start(0);
  life.Abort(v1::JOB_STATE_CANCELLED, "cancelled");
  JobLife resumed(life.job(), life.frames().infos());
  resumed.Abort(v1::JOB_STATE_CANCELLED, "cancelled");
  const JobRef job = table_.Resume(std::move(resumed), now_);
  EXPECT_FALSE(Begin());
  EXPECT_TRUE(job->finishing);
}

TEST_F(JobTableTest, EndedJobsAreFoundForThoseWhoWatch) {
  const JobRef ended = table_.AddEnded(JobLife(NewJob("a"), Names(1)));
  EXPECT_EQ(table_.Find("a"), ended);
  const JobRef again = Add(NewJob("a"), 1);
  EXPECT_EQ(table_.Find("a"), again) << "it was retried";
  table_.Forget(ended);
  EXPECT_EQ(table_.Find("a"), again);
}

TEST_F(JobTableTest, WithoutAnybodyWhoChecksResultsAreTrusted) {
  JobTable table({.checks_results = false});
  auto job = *table.Reserve(JobLife(NewJob("a"), Names(0)), v1::ROLE_CLIENT);
  table.Activate(job, now_);
  table.Abort(job, v1::JOB_STATE_CANCELLED, "cancelled");
  EXPECT_TRUE(job->finishing);
}

}  // namespace
}  // namespace weft
