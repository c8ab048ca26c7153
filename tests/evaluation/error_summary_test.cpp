#include "evaluation/error_summary.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(ErrorSummary, InterpolatesPercentiles) {
  const auto summary = Summarize({4, 1, 3, 2, 5});
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->count, 5);
  EXPECT_DOUBLE_EQ(summary->mean, 3);
  EXPECT_DOUBLE_EQ(summary->median, 3);
  // Place 0.95 * 4 = 3.8 of the sorted errors, between 4 and 5.
  EXPECT_DOUBLE_EQ(summary->p95, 4.8);
  EXPECT_DOUBLE_EQ(summary->p99, 4.96);
  EXPECT_EQ(summary->max, 5);
}

TEST(ErrorSummary, OfAnEvenCountHasTheMedianBetweenTheMiddleTwo) {
  EXPECT_DOUBLE_EQ(Summarize({1, 2, 10, 20})->median, 6);
}

TEST(ErrorSummary, OfOneErrorIsThatErrorAndOfNoneIsNone) {
  const auto one = Summarize(std::vector<double>{7});
  ASSERT_TRUE(one);
  EXPECT_EQ(one->median, 7);
  EXPECT_EQ(one->p99, 7);
  EXPECT_EQ(one->max, 7);
  EXPECT_FALSE(Summarize(std::vector<double>{}));
}

}  // namespace
}  // namespace weft
