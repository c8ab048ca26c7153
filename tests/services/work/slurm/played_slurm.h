// SlurmExecutor on a machine whose Slurm is played by scripts.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/formats/files/atomic_file.h"
#include "services/work/slurm/slurm_executor.h"

namespace weft {

// Stand in for Slurm's commands: tasks run on this machine at once, and squeue prints what the test wrote.
inline constexpr char kSbatch[] = R"(#!/bin/sh
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
inline constexpr char kSqueue[] =
    "#!/bin/sh\ndir=$(dirname \"$0\")\necho x >> \"$dir/squeue.log\"\ncat \"$dir/squeue.json\"\n";
inline constexpr char kScancel[] = R"(#!/bin/sh
dir=$(dirname "$0")
echo "$@" >> "$dir/scancel.log"
for word; do kill $(cat "$dir"/pid-${word} "$dir"/pid-${word}_* 2> /dev/null) 2> /dev/null; done
exit 0
)";
inline constexpr char kScontrol[] = R"(#!/bin/sh
dir=$(dirname "$0")
if [ "$*" = "show config" ]; then cat "$dir/config" 2> /dev/null; exit; fi
echo "$@" >> "$dir/scontrol.log"
)";
inline constexpr char kNoJobs[] = R"({"jobs": [], "errors": []})";

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

}  // namespace weft
