// What tasks and Slurm say, and how tasks end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/formats/files/atomic_file.h"
#include "tests/services/work/slurm/played_slurm.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using SlurmEventsTest = SlurmExecutorTest;

TEST_F(SlurmEventsTest, ElementsAreCancelledByThemselvesAndAnArrayAsAWhole) {
  SlurmSays("RUNNING");
  const auto patience = [](SlurmOptions& options) {
    options.query_s = 60;
    options.stop_patience = std::chrono::milliseconds(100);
  };
  Begin(patience);
  Start("a.1", {"hang"});
  Start("a.2", {"hang"});
  WaitForFile("pid-101_1");
  executor_->Stop("a.2");
  WaitForFile("scancel.log");
  EXPECT_THAT(Lines("scancel.log"), ElementsAre("--quiet 101_1"));
  executor_.reset();
  std::filesystem::remove(path_ + "/scancel.log");
  Write("next", "100\n");
  Begin(patience);
  Start("b.1", {"hang"});
  Start("b.2", {"hang"});
  WaitForFile("sbatch.log");
  for (int i = 0; i < 6000 && Lines("sbatch.log").size() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  executor_->StopAll();
  EXPECT_THAT(Lines("scancel.log"), ElementsAre("--quiet 101"));
}

TEST_F(SlurmEventsTest, ATaskThatRunsUnseenIsToldOf) {
  Write("hold", "x");
  SlurmSays("RUNNING");
  Begin([](SlurmOptions& options) { options.lag_s = 0.3; });
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_THAT(told.waits.front(), HasSubstr("a task runs on w1 for "));
  EXPECT_THAT(told.waits.front(), HasSubstr("nothing of it is seen in " + path_ + "/shared/jobs/job/"));
  EXPECT_FALSE(told.end);
  SlurmSays("NODE_FAIL");
  EXPECT_EQ(WaitForEnd("a.1").end->queued_s, 3) << "as Slurm has it";
}

TEST_F(SlurmEventsTest, AWorkerThatCouldNotBeStartedIsNotWaitedFor) {
  Write("hold", "x");
  SlurmSays("FAILED", 126 << 8);
  Begin([](SlurmOptions& options) { options.lag_s = 300; });
  Start("a.1", {"f1"});
  const Told told = WaitForEnd("a.1");
  EXPECT_FALSE(told.end->lost);
  EXPECT_THAT(told.end->reason, HasSubstr("126"));
}

TEST_F(SlurmEventsTest, TheLastWordOfAWorkerThatFailedMayComeLate) {
  Write("hold", "x");
  SlurmSays("FAILED", 125 << 8);
  Begin([](SlurmOptions& options) { options.lag_s = 0.5; });
  Start("a.1", {"f1"});
  WaitForFile("sbatch.log");
  std::this_thread::sleep_for(std::chrono::milliseconds(250));
  {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(told_["a.1"].end);
  }
  EXPECT_THAT(WaitForEnd("a.1").end->reason, HasSubstr("125"));
}

TEST_F(SlurmEventsTest, AClockThatGoesAheadIsToldOnce) {
  Write("hold", "x");
  Begin([](SlurmOptions& options) { options.query_s = 60; });
  Start("a.1", {"f1"});
  Start("a.2", {"f2"});
  WaitForFile("sbatch.log");
  const std::string words = Lines("sbatch.log").front();
  const std::string folder = words.substr(words.find(path_ + "/shared/jobs"));
  const std::string array = folder.substr(0, folder.find("/log-"));
  const int64_t ahead_ns = HostTime_ns() + 100'000'000'000;
  const std::string began = absl::StrCat(R"({"began": {"host": "w7", "hostUnixNs": )", ahead_ns, "}}\n");
  for (const char* index : {"0", "1"}) {
    ASSERT_TRUE(WriteFileAtomically(array + "/events-" + index,
                                    began + "{\"finished\": {\"frame\": \"f\"}}\n{\"ended\": {}}\n")
                    .ok());
    WaitForEnd(index[0] == '0' ? "a.1" : "a.2");
  }
  EXPECT_THAT(told_["a.1"].notes, ElementsAre(HasSubstr("the clock of node w7 is ")));
  EXPECT_THAT(told_["a.2"].notes, IsEmpty());
  EXPECT_NEAR(told_["a.1"].end->queued_s, 100, 5);
}

TEST_F(SlurmEventsTest, SlurmThatDoesNotAnswerIsToldOf) {
  Begin();
  Start("a.1", {"hang"});
  WaitForFile("pid-101_0");
  Write("squeue.json", "no JSON");
  const Told told = WaitUntil("a.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_THAT(told.waits.front(), HasSubstr("Slurm does not answer; tasks that run go on"));
  EXPECT_FALSE(told.end);
  Write("squeue.json", kNoJobs);
  executor_->Stop("a.1");
  EXPECT_EQ(WaitForEnd("a.1").end->reason, "stopped");
}

}  // namespace
}  // namespace weft
