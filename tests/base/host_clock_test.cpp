#include "base/host_clock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "base/stopwatch.h"

namespace weft {
namespace {

using ::testing::MatchesRegex;

constexpr std::chrono::milliseconds kPause{20};

TEST(HostClock, CountsNanosecondsSince1970) {
  EXPECT_GT(HostTime_ns(), 1'700'000'000'000'000'000);  // November 2023
  EXPECT_LT(HostTime_ns(), 7'000'000'000'000'000'000);
}

TEST(HostClock, IsMonotonicWhereItSaysSo) {
  const int64_t before_ns = MonotonicTime_ns();
  std::this_thread::sleep_for(kPause);
  EXPECT_GE(MonotonicTime_ns() - before_ns, std::chrono::nanoseconds(kPause).count());
}

TEST(HostClock, WritesUtc) {
  EXPECT_THAT(UtcText(), MatchesRegex("20..-[01].-[0-3].T[0-2].:[0-5].:[0-6].Z"));
  EXPECT_THAT(UtcFileName(), MatchesRegex("20..[01].[0-3].-[0-2].[0-5].[0-6]."));
}

TEST(Stopwatch, RunsFromConstruction) {
  const Stopwatch watch;
  std::this_thread::sleep_for(kPause);
  const double ms = watch.Ms();
  EXPECT_GE(ms, 20);
  EXPECT_GE(watch.Seconds(), ms / 1000);
}

}  // namespace
}  // namespace weft
