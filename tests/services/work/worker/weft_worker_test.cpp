// The program weft-worker with tasks that it cannot do. What it does with good ones is shown by the system
// tests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include "services/ground/process/exit_status.h"
#include "services/work/executor/child_process.h"
#include "services/work/worker/worker_event.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class WeftWorker : public ::testing::Test {
 protected:
  struct Ended {
    std::vector<v1::WorkerEvent> events;
    std::string errors;
    std::string exit;
  };

  Ended Run(const std::vector<std::string>& arguments) {
    Ended ended;
    absl::StatusOr<ChildProcess> worker = ChildProcess::Spawn(WEFT_WORKER, arguments);
    EXPECT_TRUE(worker.ok()) << worker.status();
    if (!worker.ok()) return ended;
    pollfd exited = {worker->exit_fd(), POLLIN, 0};
    EXPECT_EQ(poll(&exited, 1, 60'000), 1);
    LineSplitter lines;
    for (const std::string& line : lines.Add(worker->ReadOut())) {
      const absl::StatusOr<v1::WorkerEvent> event = ParseWorkerEvent(line);
      EXPECT_TRUE(event.ok()) << line;
      if (event.ok()) ended.events.push_back(*event);
    }
    EXPECT_EQ(lines.TakeRest(), "");
    ended.errors = worker->ReadErr();
    ended.exit = DescribeExit(worker->Reap());
    return ended;
  }

  Ended RunTask(const std::string& json) {
    WriteBytes(folder_ / "task.json", json);
    return Run({folder_ / "task.json"});
  }

  TempFolder folder_;
};

TEST_F(WeftWorker, NamesATaskFileThatDoesNotExist) {
  const Ended ended = Run({folder_ / "none.json"});
  EXPECT_EQ(ended.exit, "exit status 2");
  EXPECT_THAT(ended.errors, HasSubstr(folder_ / "none.json"));
}

TEST_F(WeftWorker, NamesAnUnknownFieldOfTheTask) {
  const Ended ended = RunTask("{\"id\": \"t\", \"colour\": 3}");
  EXPECT_EQ(ended.exit, "exit status 2");
  EXPECT_THAT(ended.errors, HasSubstr("colour"));
}

TEST_F(WeftWorker, TellsAnErrorOfTheTaskAsItsLastEvent) {
  const struct {
    const char* task;
    const char* message;
  } cases[] = {
      {"{\"id\": \"t\"}", "frames: "},
      {"{\"frames\": [\"0\"], \"threads\": -1}", "threads: "},
      {"{\"frames\": [\"0\"]}", "spec.out: "},
      {"{\"frames\": [\"0\"], \"spec\": {\"dump\": \"/none\", \"rig\": \"/none/rig.json\", \"board\": "
       "\"/none\", "
       "\"garment\": \"/none\", \"out\": \"/none\"}}",
       "/none"},
  };
  for (const auto& c : cases) {
    const Ended ended = RunTask(c.task);
    EXPECT_EQ(ended.exit, "exit status 2") << c.task;
    ASSERT_EQ(ended.events.size(), 2u) << c.task;
    EXPECT_EQ(ended.events[1].ended().exit_status(), 2);
    EXPECT_THAT(ended.events[0].error().message(), HasSubstr(c.message));
    EXPECT_THAT(ended.errors, HasSubstr(ended.events[0].error().message()));
  }
}

TEST_F(WeftWorker, EndsWhenItsDaemonIsGoneAlready) {
  WriteBytes(folder_ / "task.json", "{}");
  const Ended ended = Run({folder_ / "task.json", "--parent", std::to_string(getppid())});
  EXPECT_EQ(ended.exit, "exit status 1");
  EXPECT_TRUE(ended.events.empty());
}

}  // namespace
}  // namespace weft
