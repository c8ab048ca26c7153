#include "base/random.h"

#include <gtest/gtest.h>

#include <array>

namespace weft {
namespace {

// Numbers of the reference implementation (Vigna, splitmix64.c) for the seed 1234567.
TEST(Random, IsSplitMix64) {
  Random random(1234567);
  for (const uint64_t expected : {6457827717110365317u, 3203168211198807973u, 9817491932198370423u,
                                  4593380528125082431u, 16408922859458223821u})
    EXPECT_EQ(random.Next(), expected);
}

TEST(Random, DrawsAllBelowTheLimitAboutEquallyOften) {
  Random random(3);
  std::array<int, 7> times = {};
  for (int i = 0; i < 70000; ++i) ++times[random.Below(times.size())];
  for (const int count : times) EXPECT_NEAR(count, 10000, 500);
  EXPECT_EQ(random.Below(1), 0u);
}

}  // namespace
}  // namespace weft
