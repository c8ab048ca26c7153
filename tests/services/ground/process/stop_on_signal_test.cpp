#include "services/ground/process/stop_on_signal.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>

namespace weft {
namespace {

TEST(StopOnSignal, FirstSignalRequestsAStop) {
  const StopOnSignal signals;
  EXPECT_FALSE(signals.token().stop_requested());
  kill(getpid(), SIGTERM);
  for (int i = 0; i < 1000 && !signals.token().stop_requested(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(signals.token().stop_requested());
}

TEST(StopOnSignal, HangupCallsWhoeverWantsIt) {
  std::atomic<int> hangups = 0;
  const StopOnSignal signals([&hangups] { ++hangups; });
  kill(getpid(), SIGHUP);
  for (int i = 0; i < 1000 && hangups == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(hangups, 1);
  EXPECT_FALSE(signals.token().stop_requested());
}

// Which of the caught signals this thread blocks.
std::string BlockedSignals() {
  sigset_t blocked;
  pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
  std::string names;
  if (sigismember(&blocked, SIGINT)) names += "INT ";
  if (sigismember(&blocked, SIGTERM)) names += "TERM ";
  if (sigismember(&blocked, SIGHUP)) names += "HUP ";
  return names;
}

TEST(StopOnSignal, LeavesSignalsAsTheyWere) {
  ASSERT_EQ(BlockedSignals(), "");
  {
    const StopOnSignal signals;
    EXPECT_EQ(BlockedSignals(), "INT TERM ");
  }
  EXPECT_EQ(BlockedSignals(), "");
  {
    const StopOnSignal signals([] {});
    EXPECT_EQ(BlockedSignals(), "INT TERM HUP ");
  }
  EXPECT_EQ(BlockedSignals(), "");
}

// Every command of the command line ends with one.
TEST(StopOnSignal, EndsAtOnce) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) const StopOnSignal signals;
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

TEST(StopOnSignalDeathTest, HangupEndsProgramsThatDoNotWantIt) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        const StopOnSignal signals;
        kill(getpid(), SIGHUP);
        std::this_thread::sleep_for(std::chrono::seconds(60));
      },
      testing::KilledBySignal(SIGHUP), "");
}

TEST(StopOnSignalDeathTest, SecondSignalEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        const StopOnSignal signals;
        kill(getpid(), SIGINT);
        while (!signals.token().stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        kill(getpid(), SIGINT);
        std::this_thread::sleep_for(std::chrono::seconds(60));
      },
      testing::KilledBySignal(SIGINT), "");
}

}  // namespace
}  // namespace weft
