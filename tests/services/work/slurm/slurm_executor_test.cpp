#include "services/work/slurm/slurm_executor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/host_clock.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "tests/services/work/slurm/played_slurm.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(SlurmExecutorTest, TasksOfAJobAreOneArray) {
  Begin([](SlurmOptions& options) {
    options.partition = "fast";
    options.time_limit_min = 30;
    options.extra = {"--constraint=ssd"};
  });
  Start("a.1", {"f1", "f2"});
  Start("a.2", {"f3"});
  EXPECT_THAT(WaitForEnd("a.1").finished, ElementsAre("f1", "f2"));
  const Told last = WaitForEnd("a.2");
  EXPECT_TRUE(last.end->clean) << last.end->reason;
  ASSERT_EQ(Lines("sbatch.log").size(), 1u);
  for (const char* word : {"--array=0-1 ", "--no-requeue", "--partition=fast", "--time=30",
                           "--constraint=ssd", "--mem=4096M", "--job-name=weft-job "}) {
    EXPECT_THAT(Read("sbatch.log"), HasSubstr(word));
  }
  executor_.reset();
  EXPECT_FALSE(std::filesystem::exists(path_ + "/shared/jobs/job") &&
               !std::filesystem::is_empty(path_ + "/shared/jobs/job"));
}

TEST_F(SlurmExecutorTest, SlurmIsNotAskedWhileTasksSpeak) {
  Begin([](SlurmOptions& options) { options.query_s = 20; });
  Start("a.1", {"slow1", "slow2"});
  EXPECT_TRUE(WaitForEnd("a.1").end->clean);
  EXPECT_EQ(Lines("squeue.log").size(), 1u);  // for what an earlier executor left
}

TEST_F(SlurmExecutorTest, BadInputIsTold) {
  SlurmSays("FAILED", 1 << 8);
  Begin();
  Start("a.1", {"f1", "error2"});
  const Told told = WaitForEnd("a.1");
  ASSERT_TRUE(told.error);
  EXPECT_THAT(told.error->message(), HasSubstr("disk full (on node "));
  EXPECT_FALSE(told.end->lost);
}

TEST_F(SlurmExecutorTest, ACrashIsTheTasksOwn) {
  SlurmSays("FAILED", 6);
  Begin();
  Start("a.1", {"crash1"});
  const Told told = WaitForEnd("a.1");
  EXPECT_FALSE(told.end->lost);
  EXPECT_THAT(told.end->reason, HasSubstr("killed by signal 6"));
  EXPECT_THAT(told.end->reason, HasSubstr("cannot bear crash1"));
}

TEST_F(SlurmExecutorTest, ALostNodeIsNot) {
  SlurmSays("RUNNING");
  Begin();
  Start("a.1", {"f1", "hang"});
  WaitUntil("a.1", [](const Told& told) { return !told.finished.empty(); });
  SlurmSays("NODE_FAIL");
  const Told told = WaitForEnd("a.1");
  EXPECT_TRUE(told.end->lost);
  EXPECT_EQ(told.end->reason, "node w1 failed");
}

TEST_F(SlurmExecutorTest, StoppedTasksEndWhenThatIsConfirmed) {
  SlurmSays("RUNNING");
  Begin();
  Start("a.1", {"hang"});
  WaitForFile("pid-101_0");
  executor_->Stop("a.1");
  WaitForFile("scancel.log");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(told_["a.1"].end);
  }
  Write("squeue.json", kNoJobs);
  EXPECT_EQ(WaitForEnd("a.1").end->reason, "stopped");
}

TEST_F(SlurmExecutorTest, WhatSlurmRefusesForGoodEndsTheJob) {
  Write("sbatch.fails", "sbatch: error: invalid partition specified: fast\n");
  Begin();
  Start("a.1", {"f1"});
  const Told told = WaitForEnd("a.1");
  ASSERT_TRUE(told.error);
  EXPECT_EQ(told.error->code(), "FAILED_PRECONDITION");
  EXPECT_THAT(told.error->message(), HasSubstr("invalid partition specified: fast"));
}

TEST_F(SlurmExecutorTest, TasksWaitWhileSlurmIsAway) {
  Write("sbatch.fails", "sbatch: error: Unable to contact slurm controller (connect failure)\n");
  Begin();
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_THAT(told.waits.front(), HasSubstr("waits for Slurm"));
  EXPECT_THAT(told.waits.front(), HasSubstr("Unable to contact slurm controller"));
  std::filesystem::remove(path_ + "/sbatch.fails");
  EXPECT_TRUE(WaitForEnd("a.1").end->clean);
}

TEST_F(SlurmExecutorTest, SaysWhyATaskWaits) {
  Write("hold", "x");
  SlurmSays("PENDING", 0, "PartitionDown");
  Begin([](SlurmOptions& options) { options.partition = "night"; });
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_THAT(told.waits.front(), HasSubstr("partition night is down"));
  Write("squeue.json", kNoJobs);
}

TEST_F(SlurmExecutorTest, EndsWhoseEventsAreNotSeenAreLost) {
  Write("hold", "x");
  SlurmSays("COMPLETED");
  Begin([](SlurmOptions& options) { options.lag_s = 0.3; });
  Start("a.1", {"f1"});
  const Told told = WaitForEnd("a.1");
  EXPECT_TRUE(told.end->lost);
  EXPECT_THAT(told.end->reason, HasSubstr("file system of --slurm-folder lags"));
}

TEST_F(SlurmExecutorTest, EventsThatAreSeenLateCount) {
  Write("hold", "x");
  SlurmSays("COMPLETED");
  Begin();
  Start("a.1", {"f1"});
  WaitForFile("sbatch.log");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const std::string script = Lines("sbatch.log").front();
  const std::string folder = script.substr(script.find(path_ + "/shared/jobs"));
  const std::string array = folder.substr(0, folder.find("/log-"));
  ASSERT_TRUE(
      WriteFileAtomically(array + "/events-0", "{\"finished\": {\"frame\": \"f1\"}}\n{\"ended\": {}}\n")
          .ok());
  const Told told = WaitForEnd("a.1");
  EXPECT_TRUE(told.end->clean) << told.end->reason;
  EXPECT_THAT(told.finished, ElementsAre("f1"));
}

TEST_F(SlurmExecutorTest, CancelsWhatAnEarlierOneLeft) {
  Begin();
  executor_.reset();
  const std::string tag = Lines("shared/executor").front();
  Write("squeue.json",
        absl::StrCat(
            R"({"jobs": [{"job_id": 7, "array_job_id": 7, "array_task_id": 0, "job_state": "RUNNING",
        "comment": "weft:)",
            tag, R"("}, {"job_id": 8, "job_state": "RUNNING", "comment": "weft:other"}], "errors": []})"));
  Begin();
  executor_->TakeUp([](const v1::Task&) { return std::nullopt; });
  WaitForFile("scancel.log");
  EXPECT_THAT(Lines("scancel.log"), ElementsAre("--quiet 7"));
}

TEST_F(SlurmExecutorTest, TakesUpWhatAnEarlierOneLeft) {
  SlurmSays("RUNNING");
  Begin();
  Start("a.1", {"f1", "hang"});
  Start("a.2", {"f2", "hang"});
  WaitUntil("a.1", [](const Told& told) { return !told.finished.empty(); });
  WaitUntil("a.2", [](const Told& told) { return !told.finished.empty(); });
  // It does nothing any more that the next one would notice, as if it had been killed.
  const std::unique_ptr<SlurmExecutor> earlier = std::move(executor_);
  Begin();
  std::vector<std::string> offered;
  executor_->TakeUp([&](const v1::Task& task) -> std::optional<TaskListener> {
    offered.push_back(absl::StrCat(task.job_id(), " ", task.id(), " ", task.frames(0)));
    if (task.id() != "a.1") return std::nullopt;
    return ListenerOf("taken up");
  });
  EXPECT_THAT(offered, ElementsAre("job a.1 f1", "job a.2 f2"));
  WaitUntil("taken up", [](const Told& told) { return !told.finished.empty(); });
  WaitForFile("scancel.log");
  EXPECT_THAT(Lines("scancel.log"), ElementsAre("--quiet 101_1"));
  v1::Task same;
  same.set_id("a.1");
  same.set_job_id("job");
  EXPECT_TRUE(absl::IsAlreadyExists(executor_->Start(same, ListenerOf("same"))));
  SlurmSays("NODE_FAIL");
  EXPECT_EQ(WaitForEnd("taken up").end->reason, "node w1 failed");
  EXPECT_EQ(Lines("sbatch.log").size(), 1u);
}

TEST_F(SlurmExecutorTest, RunningTasksAreLimitedOverAllJobs) {
  Begin([](SlurmOptions& options) {
    options.tasks = 2;
    options.query_s = 20;
  });
  Start("a.1", {"slow1"}, "a");
  Start("a.2", {"slow2"}, "a");
  Start("a.3", {"slow3"}, "a");
  WaitForFile("sbatch.log");
  EXPECT_THAT(Lines("sbatch.log").front(), HasSubstr("--array=0-2%2"));
  Start("b.1", {"f1"}, "b");
  EXPECT_TRUE(WaitForEnd("b.1").end->clean);
  ASSERT_EQ(Lines("sbatch.log").size(), 2u);
  EXPECT_TRUE(WaitForEnd("a.3").end->clean);
}

TEST_F(SlurmExecutorTest, MemoryFollowsWhatTasksTook) {
  Begin();
  Start("a.1", {"f1"});
  WaitForEnd("a.1");
  Start("a.2", {"f2"});
  WaitForEnd("a.2");
  EXPECT_THAT(Lines("sbatch.log").back(), HasSubstr("--mem=512M"));
}

TEST_F(SlurmExecutorTest, StopAllLeavesWhatIsNotConfirmed) {
  SlurmSays("RUNNING");
  Begin([](SlurmOptions& options) { options.stop_patience = std::chrono::milliseconds(500); });
  Start("a.1", {"hang"});
  WaitForFile("pid-101_0");
  executor_->StopAll();
  EXPECT_EQ(told_["a.1"].end->reason, "stopped");
  EXPECT_THAT(Lines("scancel.log"), ::testing::Not(IsEmpty()));
}

TEST_F(SlurmExecutorTest, TellsHowItsTasksAreShaped) {
  Begin([](SlurmOptions& options) { options.frames_per_task = 7; });
  EXPECT_EQ(executor_->slots(), 1000);
  EXPECT_EQ(executor_->shape().parallel, 64) << "where nothing limits them";
  EXPECT_EQ(executor_->shape().least_frames, 7u);
  EXPECT_EQ(executor_->shape().most_frames, 7u);
  EXPECT_TRUE(executor_->shape().is_queued);
  EXPECT_EQ(executor_->LogFolder("j"), path_ + "/shared/jobs/j");
  executor_.reset();
  Begin([](SlurmOptions& options) { options.tasks = 3; });
  EXPECT_EQ(executor_->shape().parallel, 3);
}

TEST_F(SlurmExecutorTest, RefusesTasksThatItCannotName) {
  Begin();
  v1::Task task;
  const auto start = [&](const std::string& id, const std::string& job) {
    task.set_id(id), task.set_job_id(job);
    return executor_->Start(task, ListenerOf("refused"));
  };
  for (const std::string& name :
       {std::string(), std::string("."), std::string("a/b"), std::string("a\0b", 3), std::string(200, 'a')}) {
    EXPECT_TRUE(absl::IsInvalidArgument(start(name, "job"))) << name;
    EXPECT_TRUE(absl::IsInvalidArgument(start("a.1", name))) << name;
  }
  Write("hold", "x");
  EXPECT_TRUE(start(std::string(199, 'a'), "job").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(start(std::string(199, 'a'), "job")));
  executor_->StopAll();
  EXPECT_EQ(start("a.2", "job"), absl::UnavailableError("the executor is shutting down"));
}

TEST_F(SlurmExecutorTest, WordsForSbatchAreThoseOfOptionsAndJob) {
  Begin([](SlurmOptions& options) {
    options.cpus_per_task = 6, options.memory_mib = 900, options.account = "lab", options.qos = "high";
  });
  v1::Task task;
  task.set_id("a.1"), task.set_job_id("job"), task.set_priority(30);
  task.mutable_spec()->set_out(path_ + "/out");
  task.add_frames("f1");
  ASSERT_TRUE(executor_->Start(task, ListenerOf("a.1")).ok());
  EXPECT_TRUE(WaitForEnd("a.1").end->clean);
  const std::string words = Read("sbatch.log");
  for (const char* word :
       {"--parsable --array=0-0 ", "--open-mode=append", "--chdir=/",
        "--nodes=1 --ntasks=1 --cpus-per-task=6 ", "--mem=900M --nice=70 ", "--account=lab --qos=high "})
    EXPECT_THAT(words, HasSubstr(word));
  EXPECT_THAT(words, HasSubstr("--comment=weft:" + Lines("shared/executor").front() + " "));
  EXPECT_THAT(words, HasSubstr("/shared/jobs/job/"));
  EXPECT_THAT(words, HasSubstr("-1/log-%a "));
  for (const char* word : {"--time=", "--partition="}) EXPECT_FALSE(absl::StrContains(words, word)) << word;
  Start("a.2", {"f1"});  // without a priority
  WaitForEnd("a.2");
  EXPECT_THAT(Lines("sbatch.log").back(), HasSubstr("--nice=100 "));
  EXPECT_THAT(Lines("sbatch.log").back(), HasSubstr("-2/log-%a "));
}

TEST_F(SlurmExecutorTest, ATaskThatNeededMoreMemoryGetsMoreTheNextTime) {
  Write("hold", "x");
  SlurmSays("OUT_OF_MEMORY");
  Begin();
  Start("a.1", {"f1"});
  EXPECT_THAT(WaitForEnd("a.1").end->reason, HasSubstr("used more than its 4096 MiB"));
  std::filesystem::remove(path_ + "/hold");
  Write("squeue.json", kNoJobs);
  Start("a.2", {"f1"});
  EXPECT_TRUE(WaitForEnd("a.2").end->clean);
  EXPECT_THAT(Lines("sbatch.log").back(), HasSubstr("--mem=6144M"));
  Start("b.1", {"f1"}, "another");
  EXPECT_TRUE(WaitForEnd("b.1").end->clean);
  EXPECT_THAT(Lines("sbatch.log").back(), HasSubstr("--mem=4096M"));
}

TEST_F(SlurmExecutorTest, ArraysAreWrittenDownForTheNextExecutor) {
  Write("hold", "x");
  Begin([](SlurmOptions& options) {
    options.memory_mib = 900, options.query_s = 60;
    options.stop_patience = std::chrono::milliseconds(50);
  });
  const int64_t before_ns = HostTime_ns();
  Start("a.1", {"f1"});
  Start("a.2", {"f2"});
  WaitForFile("sbatch.log");
  std::string file;
  for (int i = 0; i < 6000 && file.empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path_ + "/shared/jobs"))
      if (entry.path().filename() == "array.json") file = entry.path();
  }
  v1::SubmittedArray array;
  ASSERT_TRUE(ReadJsonFile(file, array).ok()) << file;
  EXPECT_GE(array.submitted_unix_ns(), before_ns);
  EXPECT_LE(array.submitted_unix_ns(), HostTime_ns());
  array.clear_submitted_unix_ns();
  EXPECT_EQ(array.ShortDebugString(), "id: 101 tasks: 2 memory_mib: 900");
}

TEST_F(SlurmExecutorTest, HasAThousandPlaces) {
  Write("squeue.json", "no answer");  // so that none is submitted
  Begin();
  v1::Task task;
  task.set_job_id("job");
  int begun = 0;
  absl::Status refused;
  for (; begun < 2000 && refused.ok(); begun += refused.ok() ? 1 : 0) {
    task.set_id(absl::StrCat("a.", begun));
    refused = executor_->Start(task, ListenerOf(task.id()));
  }
  EXPECT_EQ(begun, 1000);
  EXPECT_EQ(refused, absl::ResourceExhaustedError("too many tasks"));
  executor_->Stop("a.7");
  EXPECT_EQ(WaitForEnd("a.7").end->reason, "stopped");
  EXPECT_TRUE(executor_->Start(task, ListenerOf("again")).ok());
}

TEST_F(SlurmExecutorTest, RefusalsOfSbatchAreTellingAndWhole) {
  Write("sbatch.fails", "sbatch: error: invalid partition specified: fast\n");
  Begin();
  Start("a.1", {"f1"});
  EXPECT_EQ(WaitForEnd("a.1").error->message(),
            "its tasks cannot be given to Slurm: " + path_ +
                "/sbatch: exit status 1; it printed: sbatch: error: invalid partition specified: fast; start "
                "weftd with "
                "other options of Slurm (`weftd --help` lists them), then `weft job retry` goes on");
  EXPECT_FALSE(told_["a.1"].end->refused);
  Write("sbatch.fails", "sbatch: error: Slurm temporarily unable to accept job\n");
  Start("b.1", {"f1"});
  const Told told = WaitUntil("b.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_EQ(
      told.waits.front(),
      "waits for Slurm, which does not take 1 more task now: " + path_ +
          "/sbatch: exit status 1; it printed: sbatch: error: Slurm temporarily unable to accept "
          "job; see MaxJobCount, MaxArraySize and MinJobAge of `scontrol show config`, and the limits on "
          "submitted "
          "jobs of the account");
}

}  // namespace
}  // namespace weft
