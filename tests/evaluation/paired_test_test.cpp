#include "evaluation/paired_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace weft {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

// x(t) = memory x(t - 1) + noise, with mean `mean`.
std::vector<double> Series(size_t length, double memory, double mean, std::mt19937& random) {
  std::normal_distribution<double> noise;
  std::vector<double> values;
  double x = noise(random) / std::sqrt(1 - memory * memory);
  for (size_t i = 0; i < length; ++i) {
    values.push_back(mean + x);
    x = memory * x + noise(random);
  }
  return values;
}

// Share of 2,000 series that the test calls different from zero at 5 %.
double RejectedShare(size_t length, double memory, double mean) {
  std::mt19937 random(7);
  int rejected = 0;
  for (int trial = 0; trial < 2000; ++trial)
    rejected += TestPairs(Series(length, memory, mean, random))->p < 0.05;
  return rejected / 2000.0;
}

TEST(PairedTest, StudentProbabilitiesAreThoseOfTheTables) {
  // Critical values of any table of the t distribution.
  EXPECT_NEAR(StudentTwoSidedP(12.7062, 1), 0.05, 1e-6);
  EXPECT_NEAR(StudentTwoSidedP(4.30265, 2), 0.05, 1e-6);
  EXPECT_NEAR(StudentTwoSidedP(3.18245, 3), 0.05, 1e-6);
  EXPECT_NEAR(StudentTwoSidedP(4.60409, 4), 0.01, 1e-6);
  EXPECT_NEAR(StudentTwoSidedP(-2.22814, 10), 0.05, 1e-6);
  EXPECT_NEAR(StudentTwoSidedP(2.94671, 15), 0.01, 1e-6);
  EXPECT_EQ(StudentTwoSidedP(0, 5), 1);
  EXPECT_EQ(StudentTwoSidedP(std::numeric_limits<double>::infinity(), 5), 0);
}

TEST(PairedTest, EqualResultsAreCalledDifferentAsRarelyAsPromised) {
  for (const size_t length : {30, 100, 300}) EXPECT_NEAR(RejectedShare(length, 0, 0), 0.05, 0.02) << length;
}

TEST(PairedTest, FramesThatResembleTheirNeighboursCountLess) {
  // As independent values, half of these would be called different.
  EXPECT_LT(RejectedShare(300, 0.8, 0), 0.10);
  EXPECT_LT(RejectedShare(100, 0.7, 0), 0.10);
}

TEST(PairedTest, FindsADifferenceThatIsThere) {
  EXPECT_GT(RejectedShare(300, 0.5, 0.5), 0.95);
  std::mt19937 random(3);
  const auto test = TestPairs(Series(3000, 0.5, 0.5, random));
  ASSERT_TRUE(test);
  EXPECT_EQ(test->count, 3000u);
  EXPECT_NEAR(test->mean, 0.5, 0.12);
  // Deviation of the mean of such a series: 1 / (1 - memory) / sqrt(n).
  EXPECT_NEAR(test->standard_error, 2 / std::sqrt(3000.0), 0.3 * 2 / std::sqrt(3000.0));
}

TEST(PairedTest, LeavesOutFramesWithoutAValue) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const auto with = TestPairs({1, none, 2, 4, none, 3, 5}), without = TestPairs({1, 2, 4, 3, 5});
  ASSERT_TRUE(with && without);
  EXPECT_EQ(with->count, 5u);
  EXPECT_EQ(with->p, without->p);
  EXPECT_FALSE(TestPairs({1, none, 2, 3}));
  EXPECT_FALSE(TestPairs({}));
}

TEST(PairedTest, EqualDifferencesAreCertain) {
  const auto none = TestPairs({0, 0, 0, 0, 0}), some = TestPairs({0.1, 0.1, 0.1, 0.1, 0.1});
  ASSERT_TRUE(none && some);
  EXPECT_EQ(none->p, 1);
  EXPECT_EQ(some->p, 0);
  EXPECT_EQ(some->standard_error, 0);
}

TEST(PairedTest, ManyTestsAtOnceAskForMore) {
  // Holm's step-down by hand: 4 x 0.01, 3 x 0.015, 2 x 0.03, and no less than the one before.
  EXPECT_THAT(HolmAdjusted({0.03, 0.01, 0.015, 0.04}),
              ElementsAre(DoubleNear(0.06, 1e-12), DoubleNear(0.04, 1e-12), DoubleNear(0.045, 1e-12),
                          DoubleNear(0.06, 1e-12)));
  EXPECT_THAT(HolmAdjusted({0.9, 0.8}), ElementsAre(1, 1));
  EXPECT_THAT(HolmAdjusted({}), ElementsAre());
}

}  // namespace
}  // namespace weft
