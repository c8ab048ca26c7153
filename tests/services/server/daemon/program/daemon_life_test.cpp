// The program weftd from its start to its end, with a service manager that is this test.
#include "services/server/daemon/program/daemon_life.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <cstring>
#include <filesystem>

#include "services/ground/process/unique_fd.h"
#include "services/server/retention/retention_plan.h"
#include "services/tools/client/registration_client.h"
#include "services/tools/client/server_client.h"
#include "services/work/executor/child_process.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/wait_until.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class DaemonLifeTest : public ::testing::Test {
 protected:
  DaemonLifeTest() : manager_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const std::string path = folder_ / "notify";
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
    EXPECT_EQ(bind(manager_.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    WriteConfig("");
  }
  ~DaemonLifeTest() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC"}) unsetenv(name);
  }

  void WriteConfig(const std::string& more) {
    WriteBytes(folder_ / "weftd.txtpb", "state: \"" + (folder_ / "state") + "\"\nallow_path: \"" +
                                            folder_.path() + "\"\nlisten: \"127.0.0.1:0\"\n" +
                                            "address_file: \"" + (folder_ / "address") + "\"\n" + more);
  }
  void Start(const std::vector<std::string>& arguments) {
    absl::StatusOr<ChildProcess> process = ChildProcess::Spawn(WEFTD, arguments);
    ASSERT_TRUE(process.ok()) << process.status();
    process_ = std::make_unique<ChildProcess>(*std::move(process));
  }
  void StartAndWait(const std::vector<std::string>& arguments) {
    Start(arguments);
    ASSERT_TRUE(Told("READY=1\nSTATUS=listens on ")) << Log();
    const std::string address = ReadBytes(folder_ / "address");
    address_ = address.substr(0, address.find('\n'));
  }

  // What was logged so far.
  const std::string& Log() {
    log_ += process_->ReadErr();
    return log_;
  }
  bool Logged(const std::string& words) {
    return WaitUntil([&] { return Log().find(words) != std::string::npos; });
  }
  // Whether the manager is told this, after what it was told before.
  bool Told(const std::string& words) {
    return WaitUntil([&] {
      char bytes[4096];
      const ssize_t n = recv(manager_.get(), bytes, sizeof bytes, 0);
      return n > 0 && std::string(bytes, static_cast<size_t>(n)).find(words) != std::string::npos;
    });
  }
  // Its exit status, once it has ended.
  int AwaitEnd() {
    EXPECT_TRUE(WaitUntil([this] {
      pollfd ended = {process_->exit_fd(), POLLIN, 0};
      return poll(&ended, 1, 0) > 0;
    })) << Log();
    const int status = process_->Reap();
    log_ += process_->ReadErr();
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  double KeepJobsDays() {
    const auto client = RegistrationClient::Connect(address_);
    EXPECT_TRUE(client.ok()) << client.status();
    if (!client.ok()) return -1;
    const auto rehearsal = ServerClient(**client).RehearseRetention({});
    EXPECT_TRUE(rehearsal.ok()) << rehearsal.status();
    return rehearsal.ok() ? rehearsal->rules().keep_jobs_days() : -1;
  }

  const TempFolder folder_;
  const UniqueFd manager_;
  std::unique_ptr<ChildProcess> process_;
  std::string log_, address_;
};

TEST_F(DaemonLifeTest, TellsWhereItListensAndStopsWhenItIsAsked) {
  StartAndWait({"--config", folder_ / "weftd.txtpb", "--workers", "2", "--threads-per-worker", "3",
                "--metrics", "127.0.0.1:0", "--console", "127.0.0.1:0"});
  EXPECT_TRUE(Logged(" listens on " + address_ + ", 2 workers with 3 threads each"));
  EXPECT_TRUE(Logged("metrics at 127.0.0.1:"));
  EXPECT_TRUE(Logged("console at "));
  process_->Signal(SIGTERM);
  EXPECT_TRUE(Told("STOPPING=1\nSTATUS=stopping; unfinished jobs go on at the next start"));
  EXPECT_EQ(AwaitEnd(), 0);
  EXPECT_THAT(Log(), HasSubstr("stopping; unfinished jobs go on at the next start"));
}

TEST_F(DaemonLifeTest, TakesOverWhatMayChangeWhileItRuns) {
  StartAndWait({"--config", folder_ / "weftd.txtpb"});
  EXPECT_EQ(KeepJobsDays(), 0);
  WriteConfig("keep_jobs_days: 5\nlog_level: \"debug\"\nworkers: 3\n");
  process_->Signal(SIGHUP);
  ASSERT_TRUE(Told("RELOADING=1\nMONOTONIC_USEC="));
  ASSERT_TRUE(Told("READY=1\nSTATUS=listens on " + address_));
  EXPECT_EQ(KeepJobsDays(), 5);
  EXPECT_TRUE(Logged("weftd.txtpb is read again: keep_jobs_days is 5, was 0; log_level is debug, was info"));
  EXPECT_TRUE(Logged("weftd.txtpb: changed, but in force only after a restart: workers"));
  process_->Signal(SIGHUP);
  EXPECT_TRUE(Logged("is read again: nothing that a running daemon takes over"));
  WriteConfig("keep_jobs_days: -5\n");
  process_->Signal(SIGHUP);
  EXPECT_TRUE(Logged("; the settings stay as they were"));
  EXPECT_EQ(KeepJobsDays(), 5);
  WriteConfig("log_level: \"error\"\n");
  process_->Signal(SIGHUP);
  ASSERT_TRUE(WaitUntil([this] { return KeepJobsDays() == 0; }));
  process_->Signal(SIGTERM);
  EXPECT_EQ(AwaitEnd(), 0);
  EXPECT_THAT(Log(), Not(HasSubstr("stopping"))) << "it is no error";
}

TEST_F(DaemonLifeTest, SaysThatThereIsNothingToReadAgain) {
  StartAndWait({"--state", folder_ / "state", "--allow-path", folder_.path(), "--listen", "127.0.0.1:0",
                "--address-file", folder_ / "address"});
  process_->Signal(SIGHUP);
  EXPECT_TRUE(Logged("SIGHUP: there is nothing to read again, since weftd was started without --config"));
  EXPECT_TRUE(Told("READY=1"));
  EXPECT_EQ(KeepJobsDays(), 0);
}

TEST_F(DaemonLifeTest, StopsWhenItIsDrained) {
  StartAndWait({"--config", folder_ / "weftd.txtpb"});
  const auto client = RegistrationClient::Connect(address_);
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_TRUE(ServerClient(**client).DrainUntilItStops({}, [](const v1::DrainProgress&) {}).ok());
  EXPECT_EQ(AwaitEnd(), 0);
}

TEST_F(DaemonLifeTest, TellsItsManagerThatItLives) {
  setenv("WATCHDOG_USEC", "300000", 1);
  StartAndWait({"--config", folder_ / "weftd.txtpb"});
  for (int i = 0; i < 2; ++i)
    EXPECT_TRUE(Told("WATCHDOG=1\nSTATUS=listens on " + address_ + "; jobs: 0 running, 0 queued"));
}

TEST_F(DaemonLifeTest, SaysWhyItDoesNotBegin) {
  Start({"--config", folder_ / "weftd.txtpb", "--allow-path", folder_ / "missing"});
  EXPECT_EQ(AwaitEnd(), 2);
  EXPECT_THAT(Log(), AllOf(HasSubstr("--allow-path: " + (folder_ / "missing") + " is no folder"),
                           Not(HasSubstr("listens on"))));
}

}  // namespace
}  // namespace weft
