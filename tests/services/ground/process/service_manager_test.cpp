#include "services/ground/process/service_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "services/ground/process/unique_fd.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::StartsWith;

// Plays the service manager, as sd_notify(3) describes it.
class ServiceManagerTest : public ::testing::Test {
 protected:
  ServiceManagerTest() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    std::strncpy(name.sun_path, path_.c_str(), sizeof(name.sun_path) - 1);
    EXPECT_EQ(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&name), sizeof(name)), 0);
    for (const char* variable : {"WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(variable);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~ServiceManagerTest() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }
  // Empty: nothing was told.
  std::string Told() const {
    char bytes[1000];
    const ssize_t size = recv(socket_.get(), bytes, sizeof(bytes), 0);
    return size > 0 ? std::string(bytes, static_cast<size_t>(size)) : "";
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "notify";
  UniqueFd socket_;
};

TEST_F(ServiceManagerTest, IsToldInOneLine) {
  NotifyReady("2 jobs\nrun");
  EXPECT_EQ(Told(), "READY=1\nSTATUS=2 jobs run");
  NotifyStopping("");
  EXPECT_EQ(Told(), "STOPPING=1\n");
  NotifyAlive("idle");
  EXPECT_EQ(Told(), "WATCHDOG=1\nSTATUS=idle");
  NotifyReloading();
  EXPECT_THAT(Told(), StartsWith("RELOADING=1\nMONOTONIC_USEC="));
}

TEST_F(ServiceManagerTest, IsNotToldWhereNoneAsked) {
  unsetenv("NOTIFY_SOCKET");
  NotifyReady("idle");
  EXPECT_EQ(Told(), "");
}

TEST_F(ServiceManagerTest, WatchesWhereItSaysHowOften) {
  EXPECT_EQ(WatchdogPeriod().count(), 0);
  setenv("WATCHDOG_USEC", "3000000", 1);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  EXPECT_EQ(WatchdogPeriod(), std::chrono::seconds(3));
  // It watches the process that it started, not a child of that.
  setenv("WATCHDOG_PID", std::to_string(getppid()).c_str(), 1);
  EXPECT_EQ(WatchdogPeriod().count(), 0);
}

}  // namespace
}  // namespace weft
