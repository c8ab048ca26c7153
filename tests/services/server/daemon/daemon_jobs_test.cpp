// What becomes of jobs: done, failed, cancelled, with workers that behave and workers that do not.
#include <map>
#include <set>
#include <thread>

#include "services/formats/files/json_file.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST_F(DaemonTest, RunsAJobToItsEndAndTellsEveryFrame) {
  options_.endings.write_report = [](const std::string& out, const v1::Job& job) {
    return WriteFileAtomically(out + "/report.html", job.id());
  };
  StartDaemon();
  const std::string id = Submit({"a", "b", "bad"});
  std::set<std::string> told;
  const auto job = client_->Watch(id, [&told](const v1::JobUpdate& update) {
    for (const v1::FrameInfo& frame : update.frames()) {
      if (frame.state() == v1::FRAME_STATE_DONE || frame.state() == v1::FRAME_STATE_FAILED)
        told.insert(frame.frame());
    }
  });
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(told, (std::set<std::string>{"a", "b", "bad"}));
  EXPECT_EQ(job->frames().done(), 2);
  EXPECT_EQ(job->frames().failed(), 1);
  EXPECT_EQ(job->inputs().rig(), "0123456789abcdef");
  ASSERT_EQ(job->warnings_size(), 1);
  EXPECT_EQ(job->remaining_s(), 0);
  EXPECT_LE(job->created_unix_ns(), job->started_unix_ns());
  EXPECT_LE(job->started_unix_ns(), job->finished_unix_ns());

  v1::Job written;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/job.json", written).ok());
  EXPECT_EQ(written.SerializeAsString(), job->SerializeAsString());
  EXPECT_EQ(ReadBytes(folder_ / "out/report.html"), id);
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "state/tasks"));
}

TEST_F(DaemonTest, TellsOfFailedFramesThatTheirNeighboursBridged) {
  StartDaemon();
  const std::string id = Submit({"a", "bad_bridged", "bad", "b"});
  int told = 0;
  const auto job = client_->Watch(id, [&told](const v1::JobUpdate& update) {
    for (const v1::FrameInfo& frame : update.frames()) told += frame.bridged();
  });
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->frames().failed(), 2);
  EXPECT_EQ(job->frames().bridged(), 1);
  EXPECT_EQ(told, 1);
  const std::vector<v1::FrameInfo> frames = Frames(id);
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_TRUE(frames[1].bridged());
  EXPECT_FALSE(frames[2].bridged());
}

TEST_F(DaemonTest, AReportThatCannotBeWrittenIsAWarning) {
  options_.endings.write_report = [](const std::string&, const v1::Job&) -> absl::Status {
    throw std::runtime_error("no font");
  };
  StartDaemon();
  const v1::Job job = WaitForEnd(Submit({"a"}));
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  ASSERT_EQ(job.warnings_size(), 2);
  EXPECT_THAT(job.warnings(1), HasSubstr("no font"));
}

TEST_F(DaemonTest, AJobWithoutAnyMeshFailsAndSaysWhy) {
  StartDaemon();
  const v1::Job job = WaitForEnd(Submit({"bad1", "bad2"}));
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.message(), HasSubstr("no frame could be registered"));
}

TEST_F(DaemonTest, SetsAsideAFrameWhoseWorkersCrashAndDoesTheOthers) {
  options_.workers = 2;
  StartDaemon();
  const std::string id = Submit({"a", "crash", "b", "exit", "leave", "c"});
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job.frames().done(), 3);
  EXPECT_EQ(job.frames().failed(), 3);
  const std::vector<v1::FrameInfo> frames = Frames(id);
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_EQ(frames[1].attempts(), 3);
  EXPECT_THAT(frames[1].reason(), HasSubstr("3 times"));
  EXPECT_THAT(frames[1].reason(), HasSubstr("signal 6"));
  EXPECT_THAT(frames[1].reason(), HasSubstr("cannot bear crash"));
  EXPECT_THAT(frames[3].reason(), HasSubstr("exit status 7"));
  EXPECT_THAT(frames[4].reason(), HasSubstr("without dealing with it"));
  EXPECT_EQ(frames[0].attempts(), 1);
  v1::FrameReport report;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/crash/report.json", report).ok());
  EXPECT_TRUE(report.set_aside());
  EXPECT_EQ(report.state(), v1::FRAME_STATE_FAILED);
}

TEST_F(DaemonTest, SetsAsideAFrameThatHangs) {
  options_.silence_limit = std::chrono::seconds(2);
  StartDaemon();
  const std::string id = Submit({"hang", "a"});
  EXPECT_EQ(WaitForEnd(id).frames().done(), 1);
  EXPECT_THAT(Frames(id)[0].reason(), HasSubstr("reported nothing"));
}

TEST_F(DaemonTest, AnErrorOfTheTaskFailsTheJobAtOnce) {
  StartDaemon();
  const std::string id = Submit({"a", "error", "b", "c"});
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.message(), HasSubstr("disk full"));
  EXPECT_EQ(job.frames().done(), 1);
  EXPECT_EQ(job.frames().cancelled(), 3);
}

TEST_F(DaemonTest, AMomentWithoutThreadsCountsAgainstNobody) {
  StartDaemon();
  for (const std::string frame : {"libgomp_lacks_threads", "throws_lacks_threads", "told_lacks_threads"}) {
    const std::string id = Submit({frame, "a"}, frame);
    // Longer than so many tries as a crash would have.
    WatchUntil(id, [](const v1::JobUpdate& update) {
      return update.job().message().find("waits until there is room") != std::string::npos;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(3500));
    EXPECT_EQ(client_->Get(id)->state(), v1::JOB_STATE_RUNNING) << frame;
    WriteBytes(folder_ / (frame + "/threads"), "");
    const v1::Job job = WaitForEnd(id);
    EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << frame << ": " << job.message();
    EXPECT_EQ(job.frames().done(), 2) << frame;
  }
}

TEST_F(DaemonTest, WorkersThatNeverBeginFailTheJob) {
  WriteBytes(folder_ / "worker", "#!/bin/sh\necho no library >&2\nexit 127\n");
  std::filesystem::permissions(folder_ / "worker", std::filesystem::perms::owner_all);
  options_.worker_program = folder_ / "worker";
  StartDaemon();
  const v1::Job job = WaitForEnd(Submit({"a", "b", "c", "d"}));
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.message(), HasSubstr("no library"));
  EXPECT_EQ(job.frames().cancelled(), 4);
}

TEST_F(DaemonTest, CancelsHalfWay) {
  StartDaemon();
  const std::string id = Submit({"a", "hang", "b"});
  WatchUntil(id, [](const v1::JobUpdate& update) { return update.job().frames().done() == 1; });
  WatchUntilRunning(id);
  const absl::StatusOr<v1::Job> job = client_->Cancel(id);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(job->frames().done(), 1);
  EXPECT_EQ(job->frames().cancelled(), 2);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/job.json"));
  const absl::StatusOr<v1::Job> again = client_->Cancel(id);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->SerializeAsString(), job->SerializeAsString());
}

TEST_F(DaemonTest, RetriesFailedFramesAloneAndTellsTheirEnd) {
  StartDaemon();
  const std::string id = Submit({"a", "bad_until_mended", "b"});
  EXPECT_EQ(WaitForEnd(id).frames().failed(), 1);
  WriteBytes(folder_ / "out/mended", "");

  const absl::StatusOr<v1::Job> retried = client_->Retry(id);
  ASSERT_TRUE(retried.ok()) << retried.status();
  EXPECT_FALSE(retried->has_verdict());
  EXPECT_EQ(retried->frames().done(), 2);
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job.frames().done(), 3);
  EXPECT_EQ(ReadBytes(folder_ / "out/log"), "a\nbad_until_mended\nb\nbad_until_mended\n");
  v1::Job written;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/job.json", written).ok());
  EXPECT_EQ(written.frames().done(), 3);

  const absl::StatusOr<v1::Job> nothing_left = client_->Retry(id);
  ASSERT_TRUE(nothing_left.ok()) << nothing_left.status();
  EXPECT_EQ(nothing_left->SerializeAsString(), job.SerializeAsString());
}

TEST_F(DaemonTest, ARetriedJobGoesOnAfterARestart) {
  StartDaemon();
  const std::string id = Submit({"a", "hang", "b"});
  WatchUntil(id, [](const v1::JobUpdate& update) {
    for (const v1::FrameInfo& frame : update.frames()) {
      if (frame.frame() == "hang" && frame.state() == v1::FRAME_STATE_RUNNING) return true;
    }
    return false;
  });
  ASSERT_TRUE(client_->Cancel(id).ok());
  ASSERT_TRUE(client_->Retry(id).ok());
  // A second retry changes nothing of a job that is not at its end.
  const absl::StatusOr<v1::Job> again = client_->Retry(id);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_FALSE(again->has_verdict());
  EXPECT_THAT(again->state(), testing::AnyOf(v1::JOB_STATE_QUEUED, v1::JOB_STATE_RUNNING));
  daemon_.reset();

  options_.silence_limit = std::chrono::milliseconds(300);
  StartDaemon();
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job.frames().done(), 2);
  EXPECT_EQ(job.frames().failed(), 1);
}

TEST_F(DaemonTest, RetriesNoJobWhoseFolderAnotherOneUses) {
  StartDaemon();
  const std::string ended = Submit({"bad"});
  WaitForEnd(ended);
  const std::string running = Submit({"hang"});
  const absl::Status status = client_->Retry(ended).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr(running));
  EXPECT_EQ(client_->Get(ended)->state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(client_->Retry("x").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(DaemonTest, CancelsAQueuedJob) {
  StartDaemon();
  const std::string first = Submit({"hang"}, "one");
  const std::string second = Submit({"a"}, "two");
  EXPECT_EQ(client_->Get(second)->state(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(client_->Cancel(second)->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(client_->Get(first)->state(), v1::JOB_STATE_RUNNING);
}

TEST_F(DaemonTest, TheNextJobUsesWorkersThatTheOldestLeavesIdle) {
  options_.workers = 2;
  StartDaemon();
  const std::string first = Submit({"hang"}, "one");
  const std::string second = Submit({"a", "b"}, "two");
  EXPECT_EQ(WaitForEnd(second).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(client_->Get(first)->state(), v1::JOB_STATE_RUNNING);
  const absl::StatusOr<std::vector<v1::Job>> jobs = client_->List(0);
  ASSERT_TRUE(jobs.ok());
  ASSERT_EQ(jobs->size(), 2u);
  EXPECT_EQ((*jobs)[0].id(), second);
}

TEST_F(DaemonTest, JobsOfHigherPriorityBeginFirstAlsoAfterARestart) {
  StartDaemon();
  const std::string first = Submit({"hang"}, "one");
  WatchUntilRunning(first);
  std::map<std::string, v1::Job> ended;
  for (const auto& [name, priority] : {std::pair{"low", -5}, {"older", 0}, {"younger", 0}, {"urgent", 7}}) {
    v1::SubmitJobRequest request = MakeRequest({"a"}, name);
    request.set_priority(priority);
    const auto job = client_->Submit(request);
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->priority(), priority);
    ended[name] = *job;
  }
  daemon_.reset();
  StartDaemon();
  ASSERT_TRUE(client_->Cancel(first).ok());
  for (auto& [name, job] : ended) job = WaitForEnd(job.id());
  const auto began = [&](const char* name) { return ended[name].started_unix_ns(); };
  EXPECT_LT(began("urgent"), began("older"));
  EXPECT_LT(began("older"), began("younger"));
  EXPECT_LT(began("younger"), began("low"));
}

TEST_F(DaemonTest, AJobThatWaitsIsMovedToWhereItsPriorityBelongs) {
  StartDaemon();
  const auto jobs = v1::Jobs::NewStub(client_->channel());
  const auto move = [&](const std::string& id, int priority) {
    v1::SetJobPriorityRequest request;
    request.set_job_id(id);
    request.set_priority(priority);
    grpc::ClientContext context;
    v1::Job job;
    const grpc::Status status = jobs->SetJobPriority(&context, request, &job);
    EXPECT_TRUE(!status.ok() || job.priority() == priority || job.state() == v1::JOB_STATE_CANCELLED);
    return status;
  };
  const std::string first = Submit({"hang"}, "one");
  WatchUntilRunning(first);
  std::map<std::string, std::string> waiting;
  for (const char* name : {"low", "middle", "high"}) waiting[name] = Submit({"a"}, name);
  EXPECT_TRUE(move(waiting["low"], -1).ok());
  EXPECT_TRUE(move(waiting["high"], 3).ok());
  // The frame that runs is not interrupted.
  EXPECT_EQ(client_->Get(first)->frames().running(), 1);
  ASSERT_TRUE(client_->Cancel(first).ok());
  std::map<std::string, int64_t> began;
  for (const auto& [name, id] : waiting) began[name] = WaitForEnd(id).started_unix_ns();
  EXPECT_LT(began["high"], began["middle"]);
  EXPECT_LT(began["middle"], began["low"]);
  EXPECT_TRUE(move(first, 9).ok()) << "a job that has ended stays as it is";
  EXPECT_EQ(client_->Get(first)->priority(), 0);
  EXPECT_EQ(move(first, 101).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(move("nobody", 1).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(DaemonTest, RefusesASecondJobIntoTheSameFolderWhileTheFirstRuns) {
  StartDaemon();
  const std::string first = Submit({"hang"});
  const absl::Status status = client_->Submit(MakeRequest({"a"})).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr(first));
  ASSERT_TRUE(client_->Cancel(first).ok());
  EXPECT_EQ(WaitForEnd(Submit({"a"})).state(), v1::JOB_STATE_DONE);
}

TEST_F(DaemonTest, EstimatesTheRemainingTimeOnceAFrameIsDone) {
  StartDaemon();
  const std::string id = Submit({"slow1", "slow2", "slow3", "slow4"});
  bool estimated = false;
  ASSERT_TRUE(client_
                  ->Watch(id,
                          [&estimated](const v1::JobUpdate& update) {
                            const v1::FrameCounts& frames = update.job().frames();
                            if (frames.done() == 0) {
                              EXPECT_LT(update.job().remaining_s(), 0.0);
                            }
                            if (frames.done() == 2 && frames.waiting() > 0)
                              estimated = update.job().remaining_s() > 0;
                          })
                  .ok());
  EXPECT_TRUE(estimated);
}

}  // namespace
}  // namespace weft
