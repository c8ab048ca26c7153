#include "services/server/daemon/program/watchdog.h"

#include <atomic>
#include <thread>

#include "services/server/access/access_list.h"
#include "services/server/daemon/door/listen_address.h"
#include "tests/services/server/access/certificate_maker.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/server/daemon/wait_until.h"

namespace weft {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

class WatchdogTest : public DaemonTest {
 protected:
  const CapturedLog log_;
};

TEST_F(WatchdogTest, AsksAsAClientDoes) {
  options_.listen = {"127.0.0.1:0", "unix:" + (folder_ / "s")};
  StartDaemon();
  for (const std::string& address : daemon_->addresses()) {
    const absl::StatusOr<v1::ServerInfo> info = AskFrontDoor(address, std::chrono::seconds(10));
    ASSERT_TRUE(info.ok()) << info.status();
    EXPECT_EQ(info->workers(), 1);
  }
}

// Neither certificate nor token: who refuses the caller has answered.
TEST_F(WatchdogTest, ARefusalIsAnAnswer) {
  CertificateMaker maker(folder_.path(), "studio");
  const CertificateFiles server = maker.Sign("weftd");
  options_.tls = {server.certificate, server.key, "", ""};
  options_.listen = {"127.0.0.1:0", "0.0.0.0:0"};
  StartDaemon();
  const std::string& address = daemon_->addresses()[1];
  const auto info = AskFrontDoor("127.0.0.1" + address.substr(address.rfind(':')), milliseconds(200));
  EXPECT_FALSE(info.ok()) << "loopback, by its name, speaks no TLS";
  const auto of_network = AskFrontDoor(address, std::chrono::seconds(10));
  ASSERT_TRUE(of_network.ok()) << of_network.status();
  EXPECT_EQ(of_network->workers(), 0) << "strangers are told nothing";
}

TEST_F(WatchdogTest, SilenceIsNone) {
  const auto nobody = ListenAt(*ParseListenAddress("127.0.0.1:0"));
  ASSERT_TRUE(nobody.ok());
  const auto before = std::chrono::steady_clock::now();
  EXPECT_EQ(AskFrontDoor(nobody->address, milliseconds(100)).status().code(),
            absl::StatusCode::kDeadlineExceeded);
  EXPECT_GE(std::chrono::steady_clock::now() - before, milliseconds(100));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(AskFrontDoor(nobody->address, std::chrono::seconds(30), stop.get_token()).status().code(),
            absl::StatusCode::kCancelled);
}

TEST_F(WatchdogTest, RestsBetweenTwoQuestions) {
  StartDaemon();
  std::atomic<int> answers = 0;
  const Watchdog watchdog(daemon_->address(), std::chrono::seconds(30),
                          [&](const v1::ServerInfo&) { ++answers; });
  ASSERT_TRUE(WaitUntil([&] { return answers >= 1; }));
  std::this_thread::sleep_for(milliseconds(150));
  EXPECT_EQ(answers, 1);
}

TEST_F(WatchdogTest, AsksAgainEachPeriodAndTellsOnceOfSilence) {
  options_.listen = {"unix:" + (folder_ / "s")};
  StartDaemon();
  const std::string unanswered =
      "error watchdog: the daemon's own call over unix:" + (folder_ / "s") + " was not answered: ";
  const std::string again = "info watchdog: the daemon answers its own calls again";
  std::atomic<int> answers = 0;
  {
    const Watchdog watchdog(daemon_->address(), milliseconds(200), [&](const v1::ServerInfo& info) {
      EXPECT_EQ(info.workers(), 1);
      ++answers;
    });
    ASSERT_TRUE(WaitUntil([&] { return answers >= 3; }));
    // A machine with other things to do may be late before.
    const int told = log_.Count(unanswered), told_again = log_.Count(again);
    daemon_.reset();
    ASSERT_TRUE(WaitUntil([&] { return log_.Count(unanswered) > told; }));
    std::this_thread::sleep_for(milliseconds(500));
    EXPECT_EQ(log_.Count(unanswered), told + 1) << "once";
    StartDaemon();
    EXPECT_TRUE(WaitUntil([&] { return log_.Count(again) > told_again; }));
  }
  const int at_end = answers;
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(answers, at_end) << "it asks no more";
}

}  // namespace
}  // namespace weft
