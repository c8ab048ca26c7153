// A queue whose executor is played by the test; catalogue and files are real.
#include "services/server/daemon/work/job_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <mutex>
#include <thread>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/server/daemon/work/lost_jobs.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/wait_until.h"
#include "tests/services/server/daemon/work/played_executor.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

v1::WorkerEvent FrameStarted(const std::string& frame) {
  v1::WorkerEvent event;
  event.mutable_started()->set_frame(frame);
  return event;
}
v1::WorkerEvent FrameFinished(const std::string& frame, v1::FrameState state = v1::FRAME_STATE_DONE) {
  v1::WorkerEvent event;
  event.mutable_finished()->set_frame(frame);
  event.mutable_finished()->set_state(state);
  return event;
}

class JobQueueTest : public ::testing::Test {
 protected:
  JobQueueTest() {
    options_.results_folder = root_ + "/results";
    options_.threads_per_worker = 3;
    options_.warnings = {"a job was lost"};
    options_.admit = [this] { return admits_; };
    options_.on_end = [this](const v1::Job& job) {
      const std::lock_guard lock(mutex_);
      ends_.push_back(absl::StrCat(job.id(), " ", v1::JobState_Name(job.state())));
      return is_full_.exchange(false) ? absl::ResourceExhaustedError("no room for notices")
                                      : absl::OkStatus();
    };
  }
  void Begin(const std::vector<v1::Task>& from_before = {}) {
    queue_.reset();
    auto executor = std::make_unique<PlayedExecutor>();
    executor_ = executor.get();
    executor_->logs = root_ + "/logs";
    executor_->from_before = from_before;
    auto catalogue = Catalogue::Open(root_ + "/catalogue.sqlite");
    ASSERT_TRUE(catalogue.ok()) << catalogue.status();
    auto queue = JobQueue::Create(*std::move(catalogue), std::move(executor), options_);
    ASSERT_TRUE(queue.ok()) << queue.status();
    queue_ = *std::move(queue);
  }
  v1::Job NewJob(const std::string& id) const {
    v1::Job job;
    job.set_id(id);
    job.set_submitted_by("user anna");
    job.mutable_inputs()->set_rig("0123456789abcdef");
    job.mutable_spec()->set_dump("/takes/" + id);
    job.mutable_spec()->set_out(root_ + "/results/" + id);
    return job;
  }
  void Submit(const v1::Job& job, const std::vector<std::string>& frames) {
    const absl::Status status = queue_->Submit(job, frames, v1::ROLE_CLIENT);
    ASSERT_TRUE(status.ok()) << status;
  }
  PlayedExecutor::Running NextTask() {
    std::optional<PlayedExecutor::Running> task;
    EXPECT_TRUE(WaitUntil([&] { return (task = executor_->Take()).has_value(); }));
    return task ? *task : PlayedExecutor::Running{{}, {[](const auto&) {}, [](const auto&) {}}};
  }
  void Finish(const PlayedExecutor::Running& task, v1::FrameState state = v1::FRAME_STATE_DONE) {
    for (const std::string& frame : task.task.frames()) task.listener.event(FrameFinished(frame, state));
    task.listener.ended({.clean = true});
  }
  v1::Job WaitForJob(const std::string& id, const std::function<bool(const v1::Job&)>& is_so) {
    absl::StatusOr<v1::Job> job;
    EXPECT_TRUE(WaitUntil([&] {
      job = queue_->Get(id);
      return job.ok() && is_so(*job);
    })) << id;
    return job.ok() ? *job : v1::Job();
  }
  v1::Job WaitForEnd(const std::string& id) {
    return WaitForJob(id, [](const v1::Job& job) { return job.finished_unix_ns() != 0; });
  }
  v1::Job Run(const std::string& id) {
    Submit(NewJob(id), {"f0", "f1"});
    Finish(NextTask());
    return WaitForEnd(id);
  }
  std::vector<std::string> Ends() {
    const std::lock_guard lock(mutex_);
    return ends_;
  }

  const TempFolder temp_;
  const std::string root_ = fs::canonical(temp_.path()).string();
  const CapturedLog log_;
  JobQueueOptions options_;
  absl::Status admits_;
  std::atomic<bool> is_full_ = false;
  std::mutex mutex_;
  std::vector<std::string> ends_;
  PlayedExecutor* executor_ = nullptr;
  std::unique_ptr<JobQueue> queue_;
};

TEST_F(JobQueueTest, TakesAJobFromItsSubmissionToItsEnd) {
  Begin();
  Submit(NewJob("a"), {"f0", "f1"});
  EXPECT_THAT(log_.Lines(), Contains("info job a: 2 frames of /takes/a, results to " + root_ + "/results/a"));
  EXPECT_THAT(queue_->Warnings(), ElementsAre("a job was lost"));
  const PlayedExecutor::Running task = NextTask();
  EXPECT_EQ(task.task.id(), "a.1");
  EXPECT_EQ(task.task.threads(), 3);
  EXPECT_EQ(queue_->CurrentLoad().running, 1);
  EXPECT_EQ(queue_->Unfinished()[0].id(), "a");
  task.listener.waits("the partition is full");
  EXPECT_EQ(queue_->Get("a")->message(), "the partition is full");
  task.listener.noted("node 3 is slow");
  EXPECT_THAT(queue_->Get("a")->warnings(), ElementsAre("node 3 is slow"));
  EXPECT_EQ(queue_->Get("a")->task_logs(), root_ + "/logs/a");
  Finish(task);
  const v1::Job ended = WaitForEnd("a");
  EXPECT_EQ(ended.state(), v1::JOB_STATE_DONE);
  EXPECT_THAT(Ends(), ElementsAre("a JOB_STATE_DONE"));
  EXPECT_TRUE(fs::exists(root_ + "/results/a/job.json"));
  const JobQueue::Load load = queue_->CurrentLoad();
  EXPECT_EQ(load.running + load.queued, 0);
  EXPECT_EQ(load.frames_done, 2);
  EXPECT_EQ(load.trouble, "");
  EXPECT_THAT(queue_->Unfinished(), IsEmpty());
  // What has ended stays as it is.
  for (const absl::StatusOr<v1::Job>& same :
       {queue_->Cancel("a"), queue_->Retry("a", v1::ROLE_CLIENT), queue_->SetPriority("a", 5)}) {
    ASSERT_TRUE(same.ok()) << same.status();
    EXPECT_EQ(same->SerializeAsString(), ended.SerializeAsString());
  }
  for (const absl::StatusOr<v1::Job>& none :
       {queue_->Get("x"), queue_->Cancel("x"), queue_->Retry("x", v1::ROLE_CLIENT),
        queue_->SetPriority("x", 5)})
    EXPECT_EQ(none.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(queue_->Frames("a")->size(), 2u);
  EXPECT_EQ(queue_->Frames("x").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobQueueTest, RefusesWhatItCannotKeepAndForgetsIt) {
  Begin();
  EXPECT_EQ(queue_->Submit(NewJob("a"), {"f\xff"}, v1::ROLE_CLIENT).message(),
            "/takes/a: the name of frame f\\xff is not UTF-8 text; rename it");
  admits_ = absl::UnavailableError("it drains");
  EXPECT_EQ(queue_->Submit(NewJob("a"), {"f0"}, v1::ROLE_CLIENT).message(), "it drains");
  admits_ = absl::OkStatus();
  Run("a");
  v1::Job again = NewJob("a");
  again.mutable_spec()->set_out(root_ + "/results/b");
  EXPECT_EQ(queue_->Submit(again, {"f0"}, v1::ROLE_CLIENT).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(queue_->CurrentLoad().queued, 0);
  Run("b");
}

TEST_F(JobQueueTest, ATaskThatCannotBeStartedWaits) {
  Begin();
  executor_->start = absl::UnavailableError("no slot");
  Submit(NewJob("a"), {"f0"});
  const v1::Job waits = WaitForJob("a", [](const v1::Job& job) { return !job.message().empty(); });
  EXPECT_EQ(waits.message(), "waits until there is room: no slot");
  {
    const std::lock_guard lock(executor_->mutex);
    executor_->start = absl::OkStatus();
  }
  Finish(NextTask());
  EXPECT_EQ(WaitForEnd("a").state(), v1::JOB_STATE_DONE);
  EXPECT_THAT(log_.Lines(), Contains("error task a.1 cannot be started: no slot"));
}

TEST_F(JobQueueTest, AnEndThatCannotBeToldWaits) {
  Begin();
  is_full_ = true;
  Submit(NewJob("a"), {"f0"});
  Finish(NextTask());
  WaitForJob("a", [](const v1::Job& job) {
    return job.message() == "waits until there is room: no room for notices";
  });
  EXPECT_EQ(WaitForEnd("a").state(), v1::JOB_STATE_DONE);
  EXPECT_THAT(Ends(), ElementsAre("a JOB_STATE_DONE", "a JOB_STATE_DONE"));
}

TEST_F(JobQueueTest, FramesThatAreIncompleteAreComputedAgain) {
  std::atomic<int> checks = 0;
  options_.find_incomplete =
      [&](const v1::Job& job,
          const std::vector<v1::FrameInfo>& frames) -> absl::StatusOr<std::vector<IncompleteFrame>> {
    EXPECT_EQ(job.id(), "a");
    EXPECT_EQ(frames.size(), 2u);
    if (++checks > 1) return std::vector<IncompleteFrame>();
    return std::vector<IncompleteFrame>{{1, "mesh.ply is missing", false}};
  };
  Begin();
  Submit(NewJob("a"), {"f0", "f1"});
  Finish(NextTask());
  const PlayedExecutor::Running again = NextTask();
  EXPECT_THAT(again.task.frames(), ElementsAre("f1"));
  Finish(again);
  EXPECT_EQ(WaitForEnd("a").state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(checks, 2);
  EXPECT_THAT(log_.Lines(), Contains("warning job a: frame f1 is registered again: mesh.ply is missing"));
}

TEST_F(JobQueueTest, WritesTheReportOfAFrameWhoseWorkersCrash) {
  Begin();
  v1::Job job = NewJob("a");
  job.mutable_spec()->mutable_options()->set_preset("best");
  Submit(job, {"f0"});
  for (int attempt = 0; attempt < 3; ++attempt) {
    const PlayedExecutor::Running task = NextTask();
    task.listener.event(FrameStarted("f0"));
    task.listener.ended({.reason = "killed by signal 11"});
  }
  EXPECT_EQ(WaitForEnd("a").state(), v1::JOB_STATE_FAILED);
  v1::FrameReport report;
  ASSERT_TRUE(ReadJsonFile(root_ + "/results/a/f0/report.json", report).ok());
  EXPECT_EQ(report.frame(), "f0");
  EXPECT_EQ(report.state(), v1::FRAME_STATE_FAILED);
  EXPECT_EQ(report.reason(), "its workers ended abnormally 3 times; last: killed by signal 11");
  EXPECT_TRUE(report.set_aside());
  EXPECT_EQ(report.inputs().rig(), "0123456789abcdef");
  EXPECT_EQ(report.options().preset(), "best");
  EXPECT_GT(report.keys_size(), 0);
  EXPECT_NE(report.weft_version(), "");
  EXPECT_EQ(queue_->CurrentLoad().frames_failed, 1);
}

TEST_F(JobQueueTest, RetriesFailedFramesAlone) {
  Begin();
  Submit(NewJob("a"), {"f0", "f1"});
  const PlayedExecutor::Running task = NextTask();
  task.listener.event(FrameFinished("f0"));
  task.listener.event(FrameFinished("f1", v1::FRAME_STATE_FAILED));
  task.listener.ended({.clean = true});
  WaitForEnd("a");
  admits_ = absl::UnavailableError("it drains");
  EXPECT_EQ(queue_->Retry("a", v1::ROLE_CLIENT).status().message(), "it drains");
  admits_ = absl::OkStatus();
  const absl::StatusOr<v1::Job> retried = queue_->Retry("a", v1::ROLE_CLIENT);
  ASSERT_TRUE(retried.ok()) << retried.status();
  EXPECT_EQ(retried->state(), v1::JOB_STATE_QUEUED);
  EXPECT_THAT(log_.Lines(), Contains("info job a is retried: 1 frames left"));
  const PlayedExecutor::Running again = NextTask();
  EXPECT_THAT(again.task.frames(), ElementsAre("f1"));
  EXPECT_EQ(queue_->Retry("a", v1::ROLE_CLIENT)->state(), v1::JOB_STATE_RUNNING) << "it runs";
  Finish(again);
  EXPECT_EQ(WaitForEnd("a").frames().done(), 2);
}

TEST_F(JobQueueTest, GoesOnWithTasksOfTheOneBefore) {
  Begin();
  Submit(NewJob("a"), {"f0", "f1"});
  NextTask().listener.event(FrameFinished("f0"));
  v1::Task of_a, of_nobody;
  of_a.set_id("a.1");
  of_a.set_job_id("a");
  of_a.add_frames("f0");
  of_a.add_frames("f1");
  of_nobody.set_id("b.1");
  of_nobody.set_job_id("b");
  Begin({of_a, of_nobody});
  EXPECT_THAT(executor_->claimed, ElementsAre("a.1 yes", "b.1 no"));
  EXPECT_THAT(log_.Lines(), Contains("info job a is resumed: 1 frames left"));
  NextTask().listener.event(FrameFinished("f1"));
  EXPECT_EQ(queue_->Frames("a")->at(1).state(), v1::FRAME_STATE_DONE);
}

TEST_F(JobQueueTest, ForgetsEndedJobsWithWhatIsItsOwn) {
  std::atomic<bool> is_read = true;
  options_.is_read = [&](const std::string& folder) { return is_read && folder == root_ + "/results/a"; };
  Begin();
  const v1::Job own = Run("a");
  v1::Job other = NewJob("b");
  other.mutable_spec()->set_out(root_ + "/elsewhere");
  Submit(other, {"f0"});
  Finish(NextTask());
  const int64_t other_ended_ns = WaitForEnd("b").finished_unix_ns();
  WriteBytes(root_ + "/logs/a/a.1.log", "said");
  WriteBytes(root_ + "/results/" + kForgottenPrefix + "old/mesh.ply", "half removed");
  std::map<std::string, int64_t> since;
  for (const Holding& held : queue_->EndedHoldings()) {
    EXPECT_EQ(held.kind, v1::HOLDING_KIND_JOB);
    EXPECT_FALSE(held.kept);
    since[held.id] = held.since_unix_ns;
  }
  EXPECT_EQ(since, (std::map<std::string, int64_t>{{"a", own.finished_unix_ns()}, {"b", other_ended_ns}}));
  EXPECT_FALSE(fs::exists(root_ + "/results/" + kForgottenPrefix + "old"));
  EXPECT_TRUE(queue_->IsInUse("a")) << "it is read";
  is_read = false;
  EXPECT_FALSE(queue_->IsInUse("a"));
  EXPECT_TRUE(queue_->IsInUse("x")) << "nobody knows";
  const absl::StatusOr<int64_t> watcher = queue_->Subscribe("a", [] {});
  ASSERT_TRUE(watcher.ok());
  EXPECT_TRUE(queue_->IsInUse("a")) << "it is watched";
  EXPECT_EQ(queue_->ForgetEnded("a", own.finished_unix_ns()).message(), "it is watched or runs again");
  EXPECT_TRUE(queue_->PollUpdates(*watcher).ended);
  queue_->Unsubscribe(*watcher);
  EXPECT_EQ(queue_->ForgetEnded("a", own.finished_unix_ns() + 1).message(), "it ran again meanwhile");
  EXPECT_EQ(queue_->ForgetEnded("x", 0).code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(queue_->ForgetEnded("a", own.finished_unix_ns()).ok());
  ASSERT_TRUE(queue_->ForgetEnded("b", other_ended_ns).ok());
  EXPECT_EQ(queue_->Get("a").status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(fs::is_empty(root_ + "/results"));
  EXPECT_TRUE(fs::is_empty(root_ + "/logs"));
  EXPECT_TRUE(fs::exists(root_ + "/elsewhere/job.json"));
  EXPECT_EQ(queue_->Subscribe("a", [] {}).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobQueueTest, KnowsTheNewestThatFollowsATake) {
  options_.is_settled = [](const std::string&) { return false; };
  Begin();
  for (const char* id : {"a", "b"}) {
    v1::Job live = NewJob(id);
    live.mutable_spec()->set_dump("/takes/t");
    live.mutable_spec()->set_live_every(1);
    Submit(live, {});
  }
  Submit(NewJob("c"), {"f0"});
  EXPECT_EQ(queue_->FollowerOf("/takes/t")->id(), "b");
  EXPECT_FALSE(queue_->FollowerOf("/takes/c")) << "it reads what is there";
  EXPECT_FALSE(queue_->FollowerOf("/takes/other"));
  ASSERT_TRUE(queue_->Cancel("b").ok());
  EXPECT_EQ(queue_->FollowerOf("/takes/t")->id(), "a");
  WaitForJob("a", [](const v1::Job& job) {
    return job.message() == "waits until its take, whose recorder died, is recovered";
  });
}

TEST_F(JobQueueTest, ItsEndKeepsNobodyWaitingForAnothers) {
  Begin();
  Submit(NewJob("a"), {"f0"});
  const PlayedExecutor::Running task = NextTask();
  absl::Status cancelled;
  const auto began = std::chrono::steady_clock::now();
  std::jthread waits([&] { cancelled = queue_->Cancel("a").status(); });
  ASSERT_TRUE(WaitUntil([this] {
    const std::lock_guard lock(executor_->mutex);
    return !executor_->stopped.empty();
  }));
  EXPECT_THAT(executor_->stopped, ElementsAre("a.1"));
  queue_->Stop();
  waits.join();
  EXPECT_EQ(cancelled.message(), "the daemon is shutting down");
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20));
}

TEST_F(JobQueueTest, TellsThoseWhoWatchThatItStops) {
  Begin();
  Submit(NewJob("a"), {"f0"});
  std::atomic<int> rung = 0;
  const absl::StatusOr<int64_t> watcher = queue_->Subscribe("a", [&] { ++rung; });
  ASSERT_TRUE(watcher.ok());
  EXPECT_EQ(queue_->CurrentLoad().watchers, 1);
  EXPECT_EQ(queue_->PollUpdates(*watcher).update->job().id(), "a");
  const PlayedExecutor::Running task = NextTask();
  EXPECT_TRUE(WaitUntil([&] { return rung > 0; }));
  EXPECT_FALSE(queue_->PollUpdates(*watcher).stopping);
  const int before = rung;
  queue_->Stop();
  EXPECT_GT(rung, before);
  EXPECT_TRUE(queue_->PollUpdates(*watcher).stopping);
  EXPECT_EQ(queue_->Submit(NewJob("b"), {"f0"}, v1::ROLE_CLIENT).message(), "the daemon is shutting down");
  const auto began = std::chrono::steady_clock::now();
  EXPECT_EQ(queue_->Cancel("a").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(5))
      << "nobody writes it down any more";
}

}  // namespace
}  // namespace weft
