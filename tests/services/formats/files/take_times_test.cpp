#include "services/formats/files/take_times.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(TakeTimes, RatesAreNamedAsPeopleNameThem) {
  // Periods in whole nanoseconds, and means of a few of them.
  EXPECT_EQ(NominalRate(1e9 / 33333333), 30);
  EXPECT_EQ(NominalRate(1e9 / 33333333.25), 30);
  EXPECT_EQ(NominalRate(1e9 / 16666667), 60);
  EXPECT_EQ(NominalRate(1e9 / 40000000), 25);
  EXPECT_EQ(NominalRate(1e9 / 33366667), 30 / 1.001);
  EXPECT_EQ(NominalRate(1e9 / 41708333), 24 / 1.001);
}

TEST(TakeTimes, OtherRatesStayAsTheyAre) {
  for (const double fps : {1e9 / 33333336, 30.001, 29.9, 12.5, 0.4, 70000.3, 0.0, -1.0})
    EXPECT_EQ(NominalRate(fps), fps);
}

}  // namespace
}  // namespace weft
