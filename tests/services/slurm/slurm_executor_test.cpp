#include "services/slurm/slurm_executor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/files/atomic_file.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Stand in for Slurm's commands: tasks run on this machine at once, and squeue prints what the test wrote.
constexpr char kSbatch[] = R"(#!/bin/sh
dir=$(dirname "$0")
echo "$@" >> "$dir/sbatch.log"
if [ -e "$dir/sbatch.fails" ]; then cat "$dir/sbatch.fails" >&2; exit 1; fi
for word; do
  case $word in --array=*) last=${word#--array=0-}; last=${last%%%*} ;; esac
done
if [ -e "$dir/limit" ] && [ $((last + 1)) -gt $(cat "$dir/limit") ]; then cat "$dir/limit.words" >&2; exit 1; fi
id=$(($(cat "$dir/next") + 1)); echo $id > "$dir/next"
for word; do
  case $word in
    --output=*) logs=$(dirname "${word#--output=}") ;;
  esac
  script=$word
done
i=0
while [ ! -e "$dir/hold" ] && [ $i -le $last ]; do
  SLURM_ARRAY_TASK_ID=$i setsid sh -c '> "$1"; exec sh "$2"' sh "$dir/started-${id}_$i" "$script" \
    > "$logs/log-$i" 2>&1 < /dev/null &
  echo $! > "$dir/pid-${id}_$i"
  until [ -e "$dir/started-${id}_$i" ]; do sleep 0.01; done
  i=$((i+1))
done
echo $id
)";
constexpr char kSqueue[] =
    "#!/bin/sh\ndir=$(dirname \"$0\")\necho x >> \"$dir/squeue.log\"\ncat \"$dir/squeue.json\"\n";
constexpr char kScancel[] = R"(#!/bin/sh
dir=$(dirname "$0")
echo "$@" >> "$dir/scancel.log"
for word; do kill $(cat "$dir"/pid-${word} "$dir"/pid-${word}_* 2> /dev/null) 2> /dev/null; done
exit 0
)";
constexpr char kScontrol[] = R"(#!/bin/sh
dir=$(dirname "$0")
if [ "$*" = "show config" ]; then cat "$dir/config" 2> /dev/null; exit; fi
echo "$@" >> "$dir/scontrol.log"
)";
constexpr char kNoJobs[] = R"({"jobs": [], "errors": []})";

class SlurmExecutorTest : public ::testing::Test {
 protected:
  struct Told {
    std::vector<std::string> finished;
    std::vector<std::string> waits, notes;
    std::optional<v1::TaskError> error;
    std::optional<TaskEnd> end;
  };

  SlurmExecutorTest() {
    std::string name = (std::filesystem::temp_directory_path() / "weft slurm XXXXXX").string();
    path_ = mkdtemp(name.data());
    std::filesystem::create_directory(path_ + "/out");
    Write("next", "100\n");
    Write("squeue.json", kNoJobs);
    for (const auto& [name_of, text] : {std::pair<const char*, const char*>{"sbatch", kSbatch},
                                        {"squeue", kSqueue},
                                        {"scancel", kScancel},
                                        {"scontrol", kScontrol}}) {
      Write(name_of, text);
      std::filesystem::permissions(path_ + "/" + name_of, std::filesystem::perms::owner_all);
    }
  }
  ~SlurmExecutorTest() override {
    executor_.reset();
    std::filesystem::remove_all(path_);
  }

  void Write(const std::string& name, const std::string& text) {
    ASSERT_TRUE(WriteFileAtomically(path_ + "/" + name, text).ok());
  }
  std::string Read(const std::string& name) { return ReadWholeFile(path_ + "/" + name).value_or(""); }
  std::vector<std::string> Lines(const std::string& name) {
    return absl::StrSplit(Read(name), '\n', absl::SkipEmpty());
  }

  // Slurm's answer for one element of array 101.
  void SlurmSays(const std::string& state, int wait_status = 0, const std::string& reason = "None") {
    Write("squeue.json",
          absl::StrCat(R"({"jobs": [{"job_id": 101, "array_job_id": 101, "array_task_id": 0, "job_state": ")",
                       state, R"(", "state_reason": ")", reason, R"(", "batch_host": "w1", "exit_code": )",
                       wait_status, R"(, "submit_time": 100, "start_time": 103}], "errors": []})"));
  }

  void Begin(const std::function<void(SlurmOptions&)>& change = [](SlurmOptions&) {}) {
    SlurmOptions options;
    options.folder = path_ + "/shared";
    options.programs_folder = path_;
    options.worker_program = ACTING_WORKER;
    options.event_period = std::chrono::milliseconds(10);
    options.query_s = 0.1;
    options.stop_patience = std::chrono::seconds(10);
    change(options);
    auto executor = SlurmExecutor::Create(options);
    ASSERT_TRUE(executor.ok()) << executor.status();
    executor_ = *std::move(executor);
  }

  void Start(const std::string& id, const std::vector<std::string>& frames, const std::string& job = "job") {
    v1::Task task;
    task.set_id(id);
    task.set_job_id(job);
    task.mutable_spec()->set_out(path_ + "/out");
    task.mutable_frames()->Assign(frames.begin(), frames.end());
    ASSERT_TRUE(executor_->Start(task, ListenerOf(id)).ok());
  }

  TaskListener ListenerOf(const std::string& id) {
    const auto change = [this, id](auto&& what) {
      const std::lock_guard lock(mutex_);
      what(told_[id]);
      changed_.notify_all();
    };
    TaskListener listener;
    listener.event = [change](const v1::WorkerEvent& event) {
      change([&](Told& told) {
        if (event.has_finished()) told.finished.push_back(event.finished().frame());
        if (event.has_error()) told.error = event.error();
      });
    };
    listener.ended = [change](const TaskEnd& end) { change([&](Told& told) { told.end = end; }); };
    listener.waits = [change](const std::string& why) {
      change([&](Told& told) { told.waits.push_back(why); });
    };
    listener.noted = [change](const std::string& note) {
      change([&](Told& told) { told.notes.push_back(note); });
    };
    return listener;
  }

  Told WaitUntil(const std::string& id, const std::function<bool(const Told&)>& condition) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, std::chrono::seconds(60), [&] { return condition(told_[id]); }))
        << id;
    return told_[id];
  }
  Told WaitForEnd(const std::string& id) {
    return WaitUntil(id, [](const Told& told) { return told.end.has_value(); });
  }
  void WaitForFile(const std::string& name) {
    for (int i = 0; i < 6000 && Read(name).empty(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_NE(Read(name), "") << name;
  }

  std::string path_;
  std::unique_ptr<SlurmExecutor> executor_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Told> told_;
};

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

TEST_F(SlurmExecutorTest, ArraysAreAsLargeAsTheClusterPermits) {
  Write("config", "MaxArraySize            = 4\nMaxJobCount             = 10000\n");
  Write("limit", "4\n");
  Write("limit.words", "sbatch: error: Batch job submission failed: Invalid job array specification\n");
  Begin();
  for (int i = 1; i <= 10; ++i) Start(absl::StrCat("a.", i), {absl::StrCat("f", i)});
  for (int i = 1; i <= 10; ++i) EXPECT_TRUE(WaitForEnd(absl::StrCat("a.", i)).end->clean) << i;
  EXPECT_EQ(Lines("sbatch.log").size(), 3u) << Read("sbatch.log");
}

TEST_F(SlurmExecutorTest, ArraysThatAreTooManyAreSplit) {
  for (const char* words : {"sbatch: error: Batch job submission failed: Invalid job array specification\n",
                            "sbatch: error: Slurm temporarily unable to accept job, sleeping and retrying\n",
                            "sbatch: error: QOSMaxSubmitJobPerUserLimit\nsbatch: error: Batch job submission "
                            "failed: Job violates "
                            "accounting/QOS policy (job submit limit, user's size and/or time limits)\n"}) {
    Write("limit", "3\n");
    Write("limit.words", words);
    Begin();
    for (int i = 1; i <= 12; ++i) Start(absl::StrCat("a.", i), {absl::StrCat("f", i)});
    for (int i = 1; i <= 12; ++i) EXPECT_TRUE(WaitForEnd(absl::StrCat("a.", i)).end->clean) << i << words;
    executor_.reset();
    told_.clear();
  }
}

TEST_F(SlurmExecutorTest, JobsOfOthersThatCannotBeReadAreTheirs) {
  Write("hold", "x");
  Write("squeue.json", R"({"jobs": [{"job_id": 55, "array_job_id": 55, "array_task_string": "5-,...",
    "job_state": "PENDING"}, {"job_id": 56}, {"job_id": 101, "array_job_id": 101, "array_task_id": 0,
    "job_state": "PENDING", "state_reason": "PartitionDown"}], "errors": []})");
  Begin();
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_THAT(told.waits.front(), HasSubstr("the default partition is down"));
  Write("squeue.json", kNoJobs);
}

TEST_F(SlurmExecutorTest, ATaskWhoseRecordCannotBeReadIsNotLost) {
  Write("hold", "x");
  Write("squeue.json", R"({"jobs": [{"job_id": 101, "array_job_id": 101, "array_task_id": 0,
    "job_state": 7}], "errors": []})");
  Begin([](SlurmOptions& options) { options.lag_s = 0.3; });
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return one.waits.size() > 5; });
  EXPECT_FALSE(told.end);
  EXPECT_THAT(told.waits.front(), HasSubstr("job_state has a value of an unknown kind"));
  Write("squeue.json", kNoJobs);
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

}  // namespace
}  // namespace weft
