#include "services/work/executor/local_executor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <condition_variable>
#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// What one task said, safe to read after WaitForEnd.
class Record {
 public:
  TaskListener Listener() {
    return {[this](const v1::WorkerEvent& event) {
              const std::lock_guard lock(mutex_);
              events.push_back(event);
              changed_.notify_all();
            },
            [this](const TaskEnd& task_end) {
              const std::lock_guard lock(mutex_);
              end = task_end;
              ended_ = true;
              changed_.notify_all();
            }};
  }
  bool WaitForEnd() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(60), [this] { return ended_; });
  }
  bool WaitForEvents(size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(60), [&] { return events.size() >= count; });
  }
  std::vector<std::string> Finished() const {
    std::vector<std::string> names;
    for (const v1::WorkerEvent& event : events) {
      if (event.has_finished()) names.push_back(event.finished().frame());
    }
    return names;
  }

  std::vector<v1::WorkerEvent> events;
  TaskEnd end;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
};

v1::Task MakeTask(const std::string& id, const std::vector<std::string>& frames) {
  v1::Task task;
  task.set_id(id);
  for (const std::string& frame : frames) task.add_frames(frame);
  return task;
}

size_t OpenDescriptors() {
  const std::filesystem::directory_iterator fds("/proc/self/fd");
  return static_cast<size_t>(std::distance(begin(fds), end(fds)));
}

class LocalExecutorTest : public ::testing::Test {
 protected:
  std::unique_ptr<LocalExecutor> Create(int workers = 1) {
    options_.worker_program = ACTING_WORKER;
    options_.task_folder = folder_ / "tasks";
    options_.workers = workers;
    auto executor = LocalExecutor::Create(options_);
    EXPECT_TRUE(executor.ok()) << executor.status();
    return *std::move(executor);
  }

  TempFolder folder_;
  LocalExecutorOptions options_;
};

TEST_F(LocalExecutorTest, ReportsEveryFrameOfATaskThenItsEnd) {
  Record record;
  const auto executor = Create();
  ASSERT_TRUE(executor->Start(MakeTask("t", {"a", "b"}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_THAT(record.Finished(), ElementsAre("a", "b"));
  EXPECT_TRUE(record.end.clean) << record.end.reason;
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "tasks"));
}

TEST_F(LocalExecutorTest, TellsHowACrashedWorkerEndedWithItsLastWords) {
  Record record;
  const auto executor = Create();
  ASSERT_TRUE(executor->Start(MakeTask("t", {"a", "crash1", "b"}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_THAT(record.Finished(), ElementsAre("a"));
  EXPECT_FALSE(record.end.clean);
  EXPECT_THAT(record.end.reason, HasSubstr("signal 6"));
  EXPECT_THAT(record.end.reason, HasSubstr("cannot bear crash1"));
}

TEST_F(LocalExecutorTest, PassesOverGarbageOnTheWorkersOutput) {
  Record record;
  const auto executor = Create();
  ASSERT_TRUE(executor->Start(MakeTask("t", {"garbage", "b"}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_TRUE(record.end.clean) << record.end.reason;
  EXPECT_THAT(record.Finished(), ElementsAre("garbage", "b"));
}

TEST_F(LocalExecutorTest, KillsAWorkerThatHangs) {
  options_.silence_limit = milliseconds(500);
  Record record;
  const auto executor = Create();
  ASSERT_TRUE(executor->Start(MakeTask("t", {"hang"}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_FALSE(record.end.clean);
  EXPECT_THAT(record.end.reason, HasSubstr("reported nothing for 0.5 s"));
}

TEST_F(LocalExecutorTest, KillsAWorkerThatDoesNotStopWhenAsked) {
  options_.stop_grace = milliseconds(200);
  Record record;
  const auto executor = Create();
  ASSERT_TRUE(executor->Start(MakeTask("t", {"stubborn"}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEvents(2));
  executor->Stop("t");
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_EQ(record.end.reason, "stopped");
}

TEST_F(LocalExecutorTest, RefusesMoreTasksThanWorkersAndReusesSlots) {
  Record first, second, third;
  const auto executor = Create(2);
  ASSERT_TRUE(executor->Start(MakeTask("1", {"hang"}), first.Listener()).ok());
  EXPECT_EQ(executor->Start(MakeTask("1", {"a"}), third.Listener()).code(), absl::StatusCode::kAlreadyExists);
  ASSERT_TRUE(executor->Start(MakeTask("2", {"a"}), second.Listener()).ok());
  ASSERT_TRUE(second.WaitForEnd());
  ASSERT_TRUE(executor->Start(MakeTask("3", {"hang"}), third.Listener()).ok());
  EXPECT_EQ(executor->Start(MakeTask("4", {"a"}), second.Listener()).code(),
            absl::StatusCode::kResourceExhausted);
  executor->StopAll();
  EXPECT_TRUE(first.WaitForEnd());
  EXPECT_TRUE(third.WaitForEnd());
  EXPECT_EQ(executor->Start(MakeTask("5", {"a"}), second.Listener()).code(), absl::StatusCode::kUnavailable);
}

TEST_F(LocalExecutorTest, RefusesTaskNamesThatArePaths) {
  const auto executor = Create();
  EXPECT_EQ(executor->Start(MakeTask("../t", {"a"}), {}).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(LocalExecutorTest, LeavesNoProcessAndNoDescriptor) {
  const size_t before = OpenDescriptors();
  {
    const auto executor = Create(2);
    for (int i = 0; i < 20; ++i) {
      Record record;
      const std::string frame = i % 2 == 0 ? "crash" : "a";
      ASSERT_TRUE(executor->Start(MakeTask("t", {frame}), record.Listener()).ok());
      ASSERT_TRUE(record.WaitForEnd());
    }
  }
  EXPECT_EQ(OpenDescriptors(), before);
  errno = 0;
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST_F(LocalExecutorTest, NamesAMissingWorkerProgram) {
  options_.worker_program = "/no/weft-worker";
  options_.task_folder = folder_ / "tasks";
  const auto executor = LocalExecutor::Create(options_);
  EXPECT_EQ(executor.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(executor.status().message()), HasSubstr("/no/weft-worker"));
}

TEST_F(LocalExecutorTest, EveryOptionHasItsLimits) {
  options_.worker_program = ACTING_WORKER;
  options_.task_folder = folder_ / "tasks";
  const auto why_not = [this](auto&& change) {
    LocalExecutorOptions options = options_;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_EQ(why_not([](LocalExecutorOptions& o) { o.workers = 1024; }), "");
  EXPECT_EQ(why_not([](LocalExecutorOptions& o) { o.workers = 1025; }), "workers: 1025, must be 1 to 1024");
  EXPECT_EQ(why_not([](LocalExecutorOptions& o) { o.workers = 0; }), "workers: 0, must be 1 to 1024");
  EXPECT_THAT(why_not([](LocalExecutorOptions& o) { o.worker_program = ""; }), HasSubstr("worker_program"));
  EXPECT_THAT(why_not([](LocalExecutorOptions& o) { o.task_folder = ""; }), HasSubstr("task_folder"));
  EXPECT_THAT(why_not([](LocalExecutorOptions& o) { o.worker_memory_mib = -1; }),
              HasSubstr("worker_memory_mib"));
  EXPECT_EQ(why_not([](LocalExecutorOptions& o) { o.stop_grace = milliseconds(0); }), "");
  EXPECT_THAT(why_not([](LocalExecutorOptions& o) { o.stop_grace = milliseconds(-1); }),
              HasSubstr("stop_grace"));
  EXPECT_EQ(why_not([](LocalExecutorOptions& o) { o.silence_limit = milliseconds(1); }), "");
  EXPECT_THAT(why_not([](LocalExecutorOptions& o) { o.silence_limit = milliseconds(0); }),
              HasSubstr("silence_limit"));
  options_.workers = 0;
  EXPECT_EQ(LocalExecutor::Create(options_).status().code(), absl::StatusCode::kInvalidArgument);
}

// A worker that shows with what it was called, and its task, once it is recorded.
TEST_F(LocalExecutorTest, WorkersAreCalledWithTheirTaskAndItsLimits) {
  options_.worker_memory_mib = 700;
  options_.worker_user = "studio";
  options_.allowed_paths = {"/data", "/home"};
  options_.state_folder = "/state";
  options_.process_folder = folder_ / "processes";
  WriteBytes(folder_ / "show", "#!/bin/sh\ncd \"" + folder_.path() +
                                   "\"\nuntil [ \"$(ls processes 2> /dev/null)\" ]; do sleep 0.01; done\nls "
                                   "processes > records\necho \"$@\" > words\ncp \"$1\" task\nexit 5\n");
  std::filesystem::permissions(folder_ / "show", std::filesystem::perms::owner_all);
  options_.worker_program = folder_ / "show";
  options_.task_folder = folder_ / "tasks";
  options_.workers = 3;
  const auto executor = LocalExecutor::Create(options_);
  ASSERT_TRUE(executor.ok()) << executor.status();
  EXPECT_EQ((*executor)->slots(), 3);
  Record record;
  ASSERT_TRUE((*executor)->Start(MakeTask("t", {}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_EQ(record.end.reason, "exit status 5");
  EXPECT_FALSE(record.end.refused);
  EXPECT_EQ(ReadBytes(folder_ / "words"), folder_ / "tasks/t.json" + " --parent " + std::to_string(getpid()) +
                                              " --memory-mib 700 --user=studio\n");
  for (const char* words : {"/data", "/home", "/state"})
    EXPECT_THAT(ReadBytes(folder_ / "task"), HasSubstr(words));
  EXPECT_THAT(ReadBytes(folder_ / "records"), ::testing::MatchesRegex("[0-9]+\n"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "processes"));
}

TEST_F(LocalExecutorTest, OfItsLastOutputTheEndIsTold) {
  WriteBytes(folder_ / "talk",
             "#!/bin/sh\nfor i in 1 2 3 4 5 6 7 8 9 10; do echo line$i; echo; done\nprintf '%0500d' 7 "
             ">&2\nexit 5\n");
  std::filesystem::permissions(folder_ / "talk", std::filesystem::perms::owner_all);
  options_.worker_program = folder_ / "talk";
  options_.task_folder = folder_ / "tasks";
  const auto executor = LocalExecutor::Create(options_);
  ASSERT_TRUE(executor.ok()) << executor.status();
  Record record;
  ASSERT_TRUE((*executor)->Start(MakeTask("t", {}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_EQ(record.end.reason,
            "exit status 5; its last output: line4 | line5 | line6 | line7 | line8 | line9 | "
            "line10 | " +
                std::string(400, '0'));
}

TEST_F(LocalExecutorTest, AWorkerThatEndsUnaskedOrAsAskedIsToldApart) {
  Record exits, leaves, stopped;
  const auto executor = Create(2);
  ASSERT_TRUE(executor->Start(MakeTask("1", {"exit"}), exits.Listener()).ok());
  ASSERT_TRUE(executor->Start(MakeTask("2", {"leave"}), leaves.Listener()).ok());
  ASSERT_TRUE(exits.WaitForEnd() && leaves.WaitForEnd());
  EXPECT_EQ(exits.end.reason, "exit status 7");
  EXPECT_FALSE(exits.end.clean);
  EXPECT_TRUE(leaves.end.clean);
  ASSERT_TRUE(executor->Start(MakeTask("3", {"hang"}), stopped.Listener()).ok());
  ASSERT_TRUE(stopped.WaitForEvents(1));
  executor->Stop("none");
  executor->Stop("3");
  ASSERT_TRUE(stopped.WaitForEnd());
  EXPECT_EQ(stopped.end.reason, "stopped");
}

TEST_F(LocalExecutorTest, ATaskThatCannotBeWrittenDownIsRefused) {
  Record record;
  const auto executor = Create();
  std::filesystem::remove(folder_ / "tasks");
  WriteBytes(folder_ / "tasks", "in the way");
  ASSERT_TRUE(executor->Start(MakeTask("t", {"a"}), record.Listener()).ok());
  ASSERT_TRUE(record.WaitForEnd());
  EXPECT_TRUE(record.end.refused);
  EXPECT_FALSE(record.end.clean);
  EXPECT_THAT(record.end.reason, HasSubstr("tasks"));
  std::filesystem::remove(folder_ / "tasks");
  Record again;
  ASSERT_TRUE(executor->Start(MakeTask("t", {"a"}), again.Listener()).ok());
  ASSERT_TRUE(again.WaitForEnd());
  EXPECT_TRUE(again.end.clean) << "the folder is made anew";
}

TEST_F(LocalExecutorTest, TaskNamesArePlainAndShort) {
  const auto executor = Create();
  for (const std::string& name :
       {std::string(), std::string(".t"), std::string("a/b"), std::string("a\0b", 3), std::string(200, 'a')})
    EXPECT_EQ(executor->Start(MakeTask(name, {"a"}), {}).code(), absl::StatusCode::kInvalidArgument) << name;
  Record record;
  ASSERT_TRUE(executor->Start(MakeTask(std::string(199, 'a'), {"a"}), record.Listener()).ok());
  EXPECT_TRUE(record.WaitForEnd());
}

}  // namespace
}  // namespace weft
