// Daemons that stop, are killed, and are started twice.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "services/work/executor/child_process.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// How often acting_worker began each frame.
int TimesComputed(const std::string& out, const std::string& frame) {
  const std::vector<std::string> lines = absl::StrSplit(ReadBytes(out + "/log"), '\n');
  return static_cast<int>(std::count(lines.begin(), lines.end(), frame));
}

TEST_F(DaemonTest, GoesOnAfterAGracefulStop) {
  StartDaemon();
  const std::string id = Submit({"a", "slow", "b"});
  WatchUntil(id, [](const v1::JobUpdate& update) { return update.job().frames().done() >= 1; });
  daemon_->Stop();
  daemon_.reset();
  StartDaemon();
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(TimesComputed(folder_ / "out", "a"), 1);
  for (const v1::FrameInfo& frame : Frames(id)) EXPECT_EQ(frame.attempts(), 1) << frame.frame();
}

TEST_F(DaemonTest, RefusesNewJobsWhenItStops) {
  StartDaemon();
  daemon_->Stop();
  const absl::Status status = client_->Submit(MakeRequest({"a"})).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
}

TEST_F(DaemonTest, ASecondDaemonOnTheStateFolderIsRefused) {
  StartDaemon();
  const auto second = Daemon::Start(options_);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("in use by another weftd"));
}

TEST_F(DaemonTest, APortThatIsTakenIsRefused) {
  StartDaemon();
  DaemonOptions second = options_;
  second.state_folder = folder_ / "state2";
  second.listen = {daemon_->address()};
  const auto daemon = Daemon::Start(second);
  EXPECT_EQ(daemon.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(daemon.status().message()), HasSubstr(daemon_->address()));
}

TEST_F(DaemonTest, WritesItsAddressOnceItListens) {
  options_.address_file = folder_ / "address";
  StartDaemon();
  EXPECT_EQ(ReadBytes(folder_ / "address"), daemon_->address() + "\n");
  EXPECT_THAT(daemon_->address(), ::testing::MatchesRegex("127\\.0\\.0\\.1:[1-9][0-9]*"));
}

TEST_F(DaemonTest, NamesOptionsThatDoNotWork) {
  DaemonOptions bad = options_;
  bad.listen = {"7411"};
  EXPECT_THAT(std::string(Daemon::Start(bad).status().message()), HasSubstr("--listen"));
  bad = options_;
  bad.allow_paths = {"/no/such/folder"};
  EXPECT_THAT(std::string(Daemon::Start(bad).status().message()), HasSubstr("--allow-path"));
  bad = options_;
  bad.worker_program = "/no/weft-worker";
  EXPECT_THAT(std::string(Daemon::Start(bad).status().message()), HasSubstr("/no/weft-worker"));
}

class KilledDaemonTest : public DaemonTest {
 protected:
  // Starts a daemon in a process of its own, and connects.
  ChildProcess StartProcess() {
    std::filesystem::remove(folder_ / "address");
    absl::StatusOr<ChildProcess> process =
        ChildProcess::Spawn(ACTING_DAEMON, {folder_.path(), ACTING_WORKER});
    EXPECT_TRUE(process.ok()) << process.status();
    for (int i = 0; i < 1000 && !std::filesystem::exists(folder_ / "address"); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    const std::string address = ReadBytes(folder_ / "address");
    Connect(address.substr(0, address.find('\n')));
    return *std::move(process);
  }

  // True when no worker of this test's daemon is left.
  bool WorkersAreGone() {
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      const std::string command = ReadBytes(entry.path() / "cmdline");
      if (command.find("acting_worker") != std::string::npos &&
          command.find(folder_ / "state/tasks") != std::string::npos) {
        return false;
      }
    }
    return true;
  }
};

TEST_F(KilledDaemonTest, ANewOneGoesOnAndNoWorkerOutlivesTheOldOne) {
  std::string id;
  {
    ChildProcess process = StartProcess();
    id = Submit({"a", "b", "hang", "c"});
    WatchUntil(id, [](const v1::JobUpdate& update) {
      return update.job().frames().done() == 2 && update.job().frames().running() == 1;
    });
    process.Signal(SIGKILL);
    process.Reap();
  }
  for (int i = 0; i < 500 && !WorkersAreGone(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_TRUE(WorkersAreGone());

  const ChildProcess process = StartProcess();
  WatchUntil(id, [](const v1::JobUpdate& update) { return update.job().frames().done() == 3; });
  WatchUntilRunning(id);
  const std::vector<v1::FrameInfo> frames = Frames(id);
  EXPECT_EQ(frames[0].state(), v1::FRAME_STATE_DONE);
  EXPECT_EQ(frames[2].state(), v1::FRAME_STATE_RUNNING);
  EXPECT_EQ(frames[2].attempts(), 1);  // the daemon's own end does not count
  EXPECT_EQ(frames[3].state(), v1::FRAME_STATE_DONE);
  EXPECT_EQ(TimesComputed(folder_ / "out", "a"), 1);
  EXPECT_EQ(client_->Cancel(id)->state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(KilledDaemonTest, ANewOneBeginsWhenTheLastWorkerOfTheOldOneIsGone) {
  std::string id;
  {
    ChildProcess process = StartProcess();
    id = Submit({"outlive"});
    while (!std::filesystem::exists(folder_ / "out/outlived"))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    process.Signal(SIGKILL);
    process.Reap();
  }
  EXPECT_EQ(TimesComputed(folder_ / "out", "late"), 0);
  const ChildProcess process = StartProcess();
  EXPECT_EQ(TimesComputed(folder_ / "out", "late"), 1);
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(TimesComputed(folder_ / "out", "outlive"), 2);
}

TEST_F(KilledDaemonTest, AJobThatWasBeingCancelledIs) {
  std::string id;
  {
    ChildProcess process = StartProcess();
    id = Submit({"a", "stubborn", "b", "c"});
    WatchUntilRunning(id);
    const std::string address = ReadBytes(folder_ / "address");
    const auto other = RegistrationClient::Connect(address.substr(0, address.find('\n')));
    ASSERT_TRUE(other.ok()) << other.status();
    std::thread canceller([&] { client_->Cancel(id).IgnoreError(); });
    while ((*other)->Get(id)->message() != "being cancelled")
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    process.Signal(SIGKILL);
    process.Reap();
    canceller.join();
  }
  const ChildProcess process = StartProcess();
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(job.message(), "cancelled");
  EXPECT_EQ(job.frames().waiting(), 0);
  EXPECT_EQ(TimesComputed(folder_ / "out", "c"), 0);
  EXPECT_EQ(job.ends_as(), v1::JOB_STATE_UNSPECIFIED);
}

TEST_F(KilledDaemonTest, AJobThatItAcceptedIsNotLost) {
  std::string queued;
  {
    ChildProcess process = StartProcess();
    Submit({"hang"}, "one");
    queued = Submit({"a"}, "two");
    process.Signal(SIGKILL);
    process.Reap();
  }
  const ChildProcess process = StartProcess();
  const absl::StatusOr<v1::Job> job = client_->Get(queued);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(client_->info().jobs_running(), 1);
}

}  // namespace
}  // namespace weft
