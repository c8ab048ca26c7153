// weft job list, show, watch, cancel, retry, fetch.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kSecond_ns = 1'000'000'000;

class CommandJob : public ::testing::Test {
 protected:
  CommandJob() {
    setenv("TZ", "UTC", 1);
    job_.set_id("walk-1");
    job_.set_state(v1::JOB_STATE_RUNNING);
    job_.set_message("the disk is nearly full");
    v1::FrameCounts& frames = *job_.mutable_frames();
    frames.set_total(10);
    frames.set_done(3);
    frames.set_degraded(1);
    job_.mutable_spec()->set_dump("/takes/walk");
    job_.mutable_spec()->set_rig("/rig.json");
    job_.mutable_spec()->set_board("/board.json");
    job_.mutable_spec()->set_garment("/shirt");
    job_.mutable_spec()->set_out("/results/walk");
    job_.mutable_inputs()->set_rig("1111");
    job_.mutable_inputs()->set_board("2222");
    job_.mutable_inputs()->set_garment("3333");
    job_.set_created_unix_ns(1'767'225'600 * kSecond_ns);  // the first second of 2026
    job_.set_started_unix_ns(1'767'225'665 * kSecond_ns);
    job_.set_remaining_s(90);
    daemon_.jobs.get = [this](const v1::GetJobRequest& request, v1::Job* job) {
      EXPECT_EQ(request.job_id(), "walk-1");
      *job = job_;
      return grpc::Status::OK;
    };
    daemon_.jobs.frames = [](const v1::ListFramesRequest&, v1::ListFramesResponse* out) {
      v1::FrameInfo& frame = *out->add_frames();
      frame.set_frame("0007");
      frame.set_state(v1::FRAME_STATE_DONE);
      frame.set_coverage(0.5);
      frame.set_total_ms(2000);
      return grpc::Status::OK;
    };
  }
  ~CommandJob() override { unsetenv("TZ"); }

  CommandRun Job(std::vector<std::string> words, bool is_quiet = false) {
    words.insert(words.begin(), "job");
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunCommand(AddJobCommand, std::move(words), is_quiet);
  }

  AnsweringDaemon daemon_;
  v1::Job job_;
};

TEST_F(CommandJob, ListsJobs) {
  daemon_.jobs.list = [this](const v1::ListJobsRequest& request, v1::ListJobsResponse* out) {
    EXPECT_EQ(request.limit(), 20);
    *out->add_jobs() = job_;
    v1::Job& other = *out->add_jobs();
    other.set_id("jog-2");
    other.set_state(v1::JOB_STATE_QUEUED);
    other.set_priority(-5);
    other.mutable_spec()->set_dump("/takes/jog");
    return grpc::Status::OK;
  };
  const CommandRun run = Job({"list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            "walk-1  running        4/10 frames  2026-01-01 00:00:00  /takes/walk\n"
            "jog-2  queued         0/0 frames  -  /takes/jog  priority -5\n");
  EXPECT_EQ(run.err, "");
  v1::ListJobsResponse listed;
  ASSERT_TRUE(ParseJson(Job({"list", "--json"}).out, "jobs", listed).ok());
  ASSERT_EQ(listed.jobs_size(), 2);
  EXPECT_EQ(listed.jobs(1).id(), "jog-2");
}

TEST_F(CommandJob, ListsNoMoreThanWereAskedFor) {
  daemon_.jobs.list = [](const v1::ListJobsRequest& request, v1::ListJobsResponse*) {
    EXPECT_EQ(request.limit(), 3);
    return grpc::Status::OK;
  };
  EXPECT_EQ(Job({"list", "--limit", "3"}).out, "no jobs at " + daemon_.address() + "\n");
}

TEST_F(CommandJob, ShowsAJobAndItsFrames) {
  v1::JobUsage& usage = *job_.mutable_usage();
  usage.set_tasks(4);
  usage.set_tasks_lost(1);
  usage.set_core_s(360);
  usage.set_peak_memory_mib(512);
  usage.set_queued_s(7);
  job_.set_task_logs("/logs");
  job_.set_priority(7);
  job_.add_warnings("camera c9 has no image");
  const CommandRun run = Job({"show", "walk-1"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            "job       walk-1\nstate     running: the disk is nearly full\n"
            "frames    4 of 10 frames registered (1 with cameras missing)\nleft      about 90 s\n"
            "dump      /takes/walk\nrig       /rig.json  1111\nboard     /board.json  2222\n"
            "template  /shirt  3333\nresults   /results/walk\n"
            "priority  7\ncreated   2026-01-01 00:00:00\nstarted   2026-01-01 00:01:05\nfinished  -\n"
            "tasks     4, 1 of them lost; 360 core-seconds, at most 512 MiB, 7 s queued\nlogs      /logs\n"
            "warning   camera c9 has no image\n0007    done        50.0 % of the cells     2.0 s\n");
}

TEST_F(CommandJob, ShowsLessOfAJobThatHasNotBegun) {
  job_.set_state(v1::JOB_STATE_QUEUED);
  job_.clear_message();
  job_.clear_usage();
  job_.mutable_verdict()->set_grade(v1::GRADE_GOOD);
  job_.mutable_spec()->mutable_driving();
  const CommandRun run = Job({"show", "walk-1"});
  EXPECT_THAT(run.out, ::testing::StartsWith("good"));
  EXPECT_THAT(run.out, HasSubstr("\nstate     queued\nframes "));
  EXPECT_THAT(run.out, HasSubstr("0007    done          2.0 s\n"));
  for (const char* word : {"left ", "tasks ", "logs "})
    EXPECT_EQ(run.out.find(word), std::string::npos) << word;
  job_.set_state(v1::JOB_STATE_RUNNING);
  job_.set_remaining_s(-1);
  EXPECT_EQ(Job({"show", "walk-1"}).out.find("left "), std::string::npos);
  job_.set_remaining_s(0);
  EXPECT_THAT(Job({"show", "walk-1"}).out, HasSubstr("left      about 0 s\n"));
}

TEST_F(CommandJob, TheJsonOfAJobHasItsFrames) {
  v1::JobUpdate all;
  ASSERT_TRUE(ParseJson(Job({"show", "walk-1", "--json"}).out, "job", all).ok());
  EXPECT_EQ(all.job().id(), "walk-1");
  ASSERT_EQ(all.frames_size(), 1);
  EXPECT_EQ(all.frames(0).frame(), "0007");
}

TEST_F(CommandJob, WatchesUntilTheJobHasEnded) {
  daemon_.jobs.watch = [this](const v1::WatchJobRequest& request, grpc::ServerWriter<v1::JobUpdate>* out) {
    EXPECT_EQ(request.job_id(), "walk-1");
    v1::JobUpdate update;
    job_.set_state(v1::JOB_STATE_DONE);
    job_.mutable_frames()->set_done(9);
    job_.mutable_verdict()->set_grade(v1::GRADE_BAD);
    *update.mutable_job() = job_;
    update.add_frames()->set_frame("0007");
    update.mutable_frames(0)->set_state(v1::FRAME_STATE_DONE);
    out->Write(update);
    return grpc::Status::OK;
  };
  const CommandRun run = Job({"watch", "walk-1"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(run.out, ::testing::StartsWith("bad"));
  EXPECT_THAT(run.out, ::testing::EndsWith("10 of 10 frames registered (1 with cameras missing)\n"
                                           "results  /results/walk\n"));
  EXPECT_EQ(run.err, "0007    done         0.0 % of the cells     0.0 s\n");
  const CommandRun quiet = Job({"watch", "walk-1"}, true);
  EXPECT_EQ(quiet.status.code(), absl::StatusCode::kAborted);
  EXPECT_EQ(quiet.out + quiet.err, "");
  v1::Job watched;
  ASSERT_TRUE(ParseJson(Job({"watch", "walk-1", "--json"}).out, "job", watched).ok());
  EXPECT_EQ(watched.id(), "walk-1");
}

TEST_F(CommandJob, TellsWhatCancellingDid) {
  daemon_.jobs.cancel = [this](const v1::CancelJobRequest& request, v1::Job* job) {
    EXPECT_EQ(request.job_id(), "walk-1");
    *job = job_;
    job->set_state(v1::JOB_STATE_CANCELLED);
    job->mutable_frames()->set_cancelled(6);
    return grpc::Status::OK;
  };
  EXPECT_EQ(Job({"cancel", "walk-1"}).out,
            "walk-1: cancelled, 4 of 10 frames registered (1 with cameras missing), 6 cancelled\n");
  EXPECT_EQ(Job({"cancel", "walk-1"}, true).out, "");
  v1::Job cancelled;
  ASSERT_TRUE(ParseJson(Job({"cancel", "walk-1", "--json"}).out, "job", cancelled).ok());
  EXPECT_EQ(cancelled.state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(CommandJob, TellsWhatIsTriedOnceMore) {
  int waiting = 0, running = 0;
  daemon_.jobs.retry = [&](const v1::RetryJobRequest& request, v1::Job* job) {
    EXPECT_EQ(request.job_id(), "walk-1");
    *job = job_;
    job->mutable_frames()->set_waiting(waiting);
    job->mutable_frames()->set_running(running);
    return grpc::Status::OK;
  };
  EXPECT_EQ(Job({"retry", "walk-1"}).out, "walk-1: running, no frame failed or was cancelled\n");
  waiting = 2, running = 1;
  EXPECT_EQ(Job({"retry", "walk-1"}).out,
            "walk-1: running, 2 frames wait; `weft job watch walk-1` shows them\n");
  waiting = 1, running = 1;
  EXPECT_EQ(Job({"retry", "walk-1"}).out,
            "walk-1: running, 1 frames wait; `weft job watch walk-1` shows them\n");
}

TEST_F(CommandJob, FetchesTheResults) {
  job_.set_state(v1::JOB_STATE_DONE);
  daemon_.jobs.fetch = [](const v1::FetchResultRequest& request, grpc::ServerWriter<v1::FileChunk>* out) {
    EXPECT_EQ(request.job_id(), "walk-1");
    const std::string text = request.frame() + " " + v1::ResultKind_Name(request.kind());
    out->Write(Chunk(text, 0, static_cast<int64_t>(text.size()), "1"));
    return grpc::Status::OK;
  };
  const TempFolder folder;
  const std::string out = folder / "here";
  const CommandRun run = Job({"fetch", "walk-1", "--out", out});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "4 of 10 frames registered (1 with cameras missing)\nresults  " + out + "\n");
  EXPECT_EQ(ReadBytes(out + "/0007/mesh.ply"), "0007 RESULT_KIND_MESH");
  EXPECT_EQ(Job({"fetch", "walk-1", "--out", out}, true).out, "");
  EXPECT_THAT(Job({"fetch", "walk-1", "--out", out, "--json"}).message(), HasSubstr("--json"));
}

}  // namespace
}  // namespace weft
