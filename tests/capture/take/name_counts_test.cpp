#include "capture/take/name_counts.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

NameCounts CountsOf(std::vector<int64_t> values, double usual_step) {
  NameCounts counts;
  counts.values = std::move(values);
  counts.usual_step = usual_step;
  return counts;
}

TEST(NameCounts, UsualStepIsTheMeanOfThoseThatAreOne) {
  EXPECT_DOUBLE_EQ(UsualStep({5}), 5);
  EXPECT_DOUBLE_EQ(UsualStep({33, 34, 33, 34}), 33.5);
  // A frame that is missing counts for nothing.
  EXPECT_DOUBLE_EQ(UsualStep({33, 34, 67}), 33.5);
}

TEST(NameCounts, AreRegularWhereStepsAreWhole) {
  EXPECT_TRUE(AreRegular(CountsOf({0, 33, 67, 134}, 33.5)));
  EXPECT_FALSE(AreRegular(CountsOf({0, 33, 83}, 33.5)));
  EXPECT_FALSE(AreRegular(CountsOf({7}, 0)));
}

TEST(NameCounts, AreUnevenWhereAStepIsNoMultipleOfTheLeast) {
  EXPECT_TRUE(AreUneven(CountsOf({0, 33, 67}, 33.5)));
  EXPECT_FALSE(AreUneven(CountsOf({0, 3, 9}, 3)));
}

TEST(NameCounts, FitALineByLeastSquares) {
  const LineFit even = FitLine(CountsOf({100, 110, 130}, 10));
  EXPECT_NEAR(even.period, 10, 1e-12);
  EXPECT_NEAR(even.first, 0, 1e-12);
  EXPECT_NEAR(even.worst, 0, 1e-12);
  // Normal equations by hand: 167 / 5, and 50 - 1.5 * 33.4.
  const LineFit rounded = FitLine(CountsOf({0, 33, 67, 100}, 33.3));
  EXPECT_NEAR(rounded.period, 33.4, 1e-12);
  EXPECT_NEAR(rounded.first, -0.1, 1e-9);
  EXPECT_NEAR(rounded.worst, 0.3, 1e-9);
}

TEST(NameCounts, AreReadFromNames) {
  const auto counts = CountsInNames({"0010", "0020", "0030"});
  ASSERT_TRUE(counts.ok());
  ASSERT_TRUE(counts->has_value());
  EXPECT_EQ((*counts)->values, (std::vector<int64_t>{10, 20, 30}));
  EXPECT_DOUBLE_EQ((*counts)->usual_step, 10);
  EXPECT_FALSE((*counts)->has_fraction);
}

}  // namespace
}  // namespace weft
