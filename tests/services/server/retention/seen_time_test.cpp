#include "services/server/retention/seen_time.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/services/server/retention/spans_of_time.h"

namespace weft {
namespace {

constexpr int64_t kStart_ns = 20'000 * kDay_ns;

// A host: the time that really passes, and what its clocks say.
struct Host {
  int64_t true_ns = 0, clock_error_ns = 0;
  int64_t Unix() const { return kStart_ns + true_ns + clock_error_ns; }
  int64_t Monotonic() const { return 5 * kHour_ns + true_ns; }
};

void Watch(SeenTime& seen, Host& host, int64_t length_ns, int64_t step_ns = kMinute_ns) {
  for (int64_t end = host.true_ns + length_ns; host.true_ns < end;) {
    host.true_ns = std::min(end, host.true_ns + step_ns);
    seen.Advance(host.Unix(), host.Monotonic());
  }
}

TEST(SeenTime, IsWhatPassedWhileADaemonLooked) {
  SeenTime seen;
  Host host;
  EXPECT_TRUE(seen.Advance(host.Unix(), host.Monotonic()).first);
  Watch(seen, host, kHour_ns);
  const int64_t event = host.Unix();
  Watch(seen, host, 3 * kHour_ns);
  EXPECT_EQ(seen.seen_ns(), 4 * kHour_ns);
  EXPECT_EQ(seen.Age_ns(event), 3 * kHour_ns);
  EXPECT_EQ(seen.Age_ns(kStart_ns - 400 * kDay_ns), 4 * kHour_ns);  // older than all
  EXPECT_EQ(seen.Age_ns(host.Unix() + kDay_ns), 0);                 // not yet
  EXPECT_EQ(seen.periods().size(), 1u);
}

TEST(SeenTime, GoesOnAfterAStartWithoutTheGap) {
  Host host;
  SeenTime before;
  before.Advance(host.Unix(), host.Monotonic());
  Watch(before, host, 2 * kHour_ns);
  const int64_t early = kStart_ns + kHour_ns;
  host.true_ns += 10 * kDay_ns;
  const int64_t meanwhile = kStart_ns + 5 * kDay_ns;  // a take goes on without a daemon
  SeenTime after(before.periods());
  const SeenTime::Look look = after.Advance(host.Unix(), host.Monotonic());
  EXPECT_TRUE(look.first);
  EXPECT_EQ(look.jump_ns, 0);
  Watch(after, host, kHour_ns);
  EXPECT_EQ(after.seen_ns(), 3 * kHour_ns);
  EXPECT_EQ(after.Age_ns(early), 2 * kHour_ns);
  EXPECT_EQ(after.Age_ns(meanwhile), kHour_ns);
  // A later gap does not make it younger.
  host.true_ns += kDay_ns;
  SeenTime third(after.periods());
  third.Advance(host.Unix(), host.Monotonic());
  EXPECT_EQ(third.Age_ns(meanwhile), kHour_ns);
}

TEST(SeenTime, AJumpMakesNothingOlder) {
  for (const int64_t jump_ns : {400 * kDay_ns, -400 * kDay_ns, 8 * kDay_ns, -kHour_ns, kMinute_ns}) {
    SCOPED_TRACE(jump_ns / kMinute_ns);
    Host host;
    SeenTime seen;
    seen.Advance(host.Unix(), host.Monotonic());
    Watch(seen, host, kDay_ns);
    const int64_t event = host.Unix();
    Watch(seen, host, kHour_ns);
    host.clock_error_ns += jump_ns;
    host.true_ns += kMinute_ns;
    EXPECT_NE(seen.Advance(host.Unix(), host.Monotonic()).jump_ns, 0);
    EXPECT_LE(seen.Age_ns(event), kHour_ns + kMinute_ns);
    const int64_t after = host.Unix();
    Watch(seen, host, kHour_ns);
    EXPECT_LE(seen.Age_ns(after), kHour_ns);
    host.clock_error_ns = 0;
    Watch(seen, host, 2 * kHour_ns);
    EXPECT_LE(seen.Age_ns(event), 4 * kHour_ns + kMinute_ns);
  }
}

// A process that was stopped, or a machine that slept; a clock that is disciplined.
TEST(SeenTime, CountsLongPausesAsOneLook) {
  Host host;
  SeenTime seen;
  seen.Advance(host.Unix(), host.Monotonic());
  host.true_ns += 30 * kDay_ns;
  EXPECT_NE(seen.Advance(host.Unix(), host.Monotonic()).jump_ns, 0);
  EXPECT_EQ(seen.seen_ns(), SeenTime::kLongestLook_ns);
  EXPECT_EQ(seen.Age_ns(kStart_ns), SeenTime::kLongestLook_ns);
}

TEST(SeenTime, FollowsASlewedClock) {
  Host host;
  SeenTime seen;
  seen.Advance(host.Unix(), host.Monotonic());
  int jumps = 0;
  for (int minute = 0; minute < 7 * 24 * 60; ++minute) {
    host.true_ns += kMinute_ns;
    host.clock_error_ns += kMinute_ns / 2000;  // 500 ppm, the most that Linux slews
    jumps += seen.Advance(host.Unix(), host.Monotonic()).jump_ns != 0;
  }
  EXPECT_EQ(seen.seen_ns(), 7 * kDay_ns);
  EXPECT_LT(jumps, 40);
  EXPECT_NEAR(static_cast<double>(seen.Age_ns(kStart_ns)), 7.0 * kDay_ns, 0.01 * kDay_ns);
}

// Whatever clocks and starts do: what happened while a daemon looked is never older than the time that it has
// seen since.
TEST(SeenTime, NothingIsEverOlderThanItIs) {
  std::mt19937_64 random(7);
  const auto below = [&](int64_t most) {
    return static_cast<int64_t>(random() % static_cast<uint64_t>(most));
  };
  for (int trial = 0; trial < 300; ++trial) {
    Host host;
    SeenTime seen;
    struct Event {
      int64_t unix_ns = 0, seen_ns = 0;
    };
    std::vector<Event> events;
    seen.Advance(host.Unix(), host.Monotonic());
    for (int step = 0; step < 60; ++step) {
      const uint64_t what = random() % 8;
      if (what == 0) {
        host.clock_error_ns += below(800 * kDay_ns) - 400 * kDay_ns;
      } else if (what == 1) {
        host.clock_error_ns = 0;
      } else if (what == 2) {
        host.true_ns += below(20 * kDay_ns);
        seen = SeenTime(seen.periods());
      } else {
        Watch(seen, host, 1 + below(5 * kHour_ns));
        events.push_back({host.Unix(), seen.seen_ns()});
      }
      host.true_ns += kSecond_ns;
      seen.Advance(host.Unix(), host.Monotonic());
      for (const Event& event : events) {
        const int64_t most_ns = seen.seen_ns() - event.seen_ns + SeenTime::kSmallestJump_ns;
        ASSERT_LE(seen.Age_ns(event.unix_ns), most_ns) << "trial " << trial << ", step " << step;
      }
    }
    ASSERT_LE(seen.periods().size(), SeenTime::kMostPeriods);
  }
}

// What the file says of earlier daemons, and nothing that was seen since.
TEST(SeenTime, DatesWhatHappenedByItsPeriods) {
  const SeenTime seen({{100, 200, 0}, {300, 400, 100}});
  EXPECT_EQ(seen.seen_ns(), 200);
  const std::vector<std::pair<int64_t, int64_t>> ages = {
      {99, 200}, {100, 200}, {150, 150}, {200, 100}, {250, 100}, {300, 100}, {301, 99}, {400, 0}, {401, 0}};
  for (const auto& [unix_ns, age_ns] : ages) EXPECT_EQ(seen.Age_ns(unix_ns), age_ns) << unix_ns;
}

TEST(SeenTime, TheYoungerAgeCountsWhereTheClockWasSetBack) {
  const SeenTime seen({{1000, 2000, 0}, {500, 600, 1000}, {1900, 3000, 1100}});
  EXPECT_EQ(seen.seen_ns(), 2200);
  const std::vector<std::pair<int64_t, int64_t>> ages = {{400, 1200}, {500, 1200},  {550, 1150},  {600, 1100},
                                                         {700, 1100}, {1500, 1700}, {1950, 1050}, {3000, 0}};
  for (const auto& [unix_ns, age_ns] : ages) EXPECT_EQ(seen.Age_ns(unix_ns), age_ns) << unix_ns;
  const SeenTime later({{1000, 2000, 0}, {500, 600, 1000}});
  EXPECT_EQ(later.Age_ns(700), 0);
  EXPECT_EQ(later.Age_ns(400), 100);
  EXPECT_EQ(SeenTime().Age_ns(0), 0);
}

TEST(SeenTime, BelievesNoFileInWhichTimeGoesBack) {
  const SeenTime back({{100, 50, 7}});
  EXPECT_TRUE(back.periods().empty());
  EXPECT_EQ(back.seen_ns(), 0);
  EXPECT_EQ(SeenTime({{100, 100, 5}}).seen_ns(), 5);
  const SeenTime overlapping({{0, 100, 0}, {200, 300, 50}});
  EXPECT_EQ(overlapping.seen_ns(), 200);
  EXPECT_EQ(overlapping.periods().back().begin_seen_ns, 100);
}

TEST(SeenTime, TenSecondsAreNoJump) {
  SeenTime seen;
  seen.Advance(kStart_ns, 0);
  EXPECT_EQ(seen.Advance(kStart_ns + kSecond_ns + SeenTime::kSmallestJump_ns, kSecond_ns).jump_ns, 0);
  EXPECT_EQ(seen.periods().back().end_unix_ns, kStart_ns + kSecond_ns) << "by what was seen";
  EXPECT_EQ(seen.Advance(kStart_ns + kSecond_ns - SeenTime::kSmallestJump_ns, kSecond_ns).jump_ns, 0);
  const int64_t more_ns = SeenTime::kSmallestJump_ns + 1;
  const SeenTime::Look look = seen.Advance(kStart_ns + kSecond_ns + more_ns, kSecond_ns);
  EXPECT_EQ(look.jump_ns, more_ns);
  EXPECT_FALSE(look.first);
  ASSERT_EQ(seen.periods().size(), 2u);
  EXPECT_EQ(seen.periods()[1].begin_unix_ns, kStart_ns + kSecond_ns + more_ns);
  EXPECT_EQ(seen.periods()[1].begin_seen_ns, kSecond_ns);
  EXPECT_EQ(seen.Advance(seen.periods()[1].begin_unix_ns, 0).jump_ns,
            0);  // a clock that went back counts nothing
  EXPECT_EQ(seen.seen_ns(), kSecond_ns);
}

TEST(SeenTime, ForgetsTheOldestOfVeryManyPeriods) {
  SeenTime seen;
  for (int64_t i = 0; i < 2000; ++i) seen.Advance(kStart_ns + i * kHour_ns, 0);
  EXPECT_EQ(seen.periods().size(), 2000u);
  EXPECT_EQ(seen.periods().front().begin_unix_ns, kStart_ns);
  seen.Advance(kStart_ns - kHour_ns, 0);
  EXPECT_EQ(seen.periods().size(), 2000u);
  EXPECT_EQ(seen.periods().front().begin_unix_ns, kStart_ns + kHour_ns);
}

}  // namespace
}  // namespace weft
