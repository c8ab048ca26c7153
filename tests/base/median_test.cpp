#include "base/median.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace weft {
namespace {

using ::testing::UnorderedElementsAre;

TEST(Median, IsTheOneInTheMiddleOrTheUpperOfTwo) {
  EXPECT_EQ(Median(std::vector<int>{7}), 7);
  EXPECT_EQ(Median(std::vector<int>{9, 1}), 9);
  EXPECT_EQ(Median(std::vector<int>{5, 1, 9}), 5);
  EXPECT_EQ(Median(std::vector<double>{4, 1, 3, 2}), 3);
  EXPECT_EQ(Median(std::vector<uint8_t>{255, 0, 255, 255}), 255);
}

TEST(Median, OfNoneIsZeroAndTheCallersValuesStay) {
  EXPECT_EQ(Median(std::vector<double>{}), 0);
  const std::vector<int> values = {3, 1, 2};
  EXPECT_EQ(Median(values), 2);
  EXPECT_EQ(values, (std::vector<int>{3, 1, 2}));
}

TEST(ValueAtRank, FindsEveryRankAndOnlyReorders) {
  for (size_t rank = 0; rank < 4; ++rank) {
    std::vector<int> values = {30, 0, 20, 10};
    EXPECT_EQ(ValueAtRank(values, rank), 10 * static_cast<int>(rank));
    EXPECT_THAT(values, UnorderedElementsAre(0, 10, 20, 30));
  }
}

TEST(Quantile, RoundsTheRankDown) {
  const std::vector<int> values = {4, 2, 0, 1, 3};
  EXPECT_EQ(Quantile(values, 0), 0);
  EXPECT_EQ(Quantile(values, 0.249), 0);
  EXPECT_EQ(Quantile(values, 0.25), 1);
  EXPECT_EQ(Quantile(values, 0.99), 3);
  EXPECT_EQ(Quantile(values, 1), 4);
  EXPECT_EQ(Quantile(std::vector<double>{}, 1), 0);
}

}  // namespace
}  // namespace weft
