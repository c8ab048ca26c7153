#include "base/natural_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace weft {
namespace {

using ::testing::ElementsAre;

TEST(NaturalOrder, TakesNumbersByTheirValue) {
  std::vector<std::string> names = {"cam10", "cam9b", "cam9a", "b1", "cam2", "cam", "10", "9"};
  std::sort(names.begin(), names.end(), NaturalOrder());
  EXPECT_THAT(names, ElementsAre("9", "10", "b1", "cam", "cam2", "cam9a", "cam9b", "cam10"));
}

TEST(NaturalOrder, TakesFractionsOfTimesAsSuchAndOthersAsVersions) {
  std::vector<std::string> names = {"t_1623840123.5", "t_1623840123.45", "t_1623840123.55", "t_1623840124",
                                    "t_1623840123.1"};
  std::sort(names.begin(), names.end(), NaturalOrder());
  EXPECT_THAT(names, ElementsAre("t_1623840123.1", "t_1623840123.45", "t_1623840123.5", "t_1623840123.55",
                                 "t_1623840124"));
  EXPECT_TRUE(NaturalLess("take1.9", "take1.10"));
}

TEST(NaturalOrder, TellsNamesApartThatDifferInZerosOnly) {
  EXPECT_TRUE(NaturalLess("a01", "a2"));
  EXPECT_TRUE(NaturalLess("a00", "a1"));
  EXPECT_NE(NaturalLess("a01", "a1"), NaturalLess("a1", "a01"));
  EXPECT_NE(NaturalLess("a00b", "a0b"), NaturalLess("a0b", "a00b"));
  EXPECT_FALSE(NaturalLess("a07", "a07"));
}

TEST(NaturalOrder, NeedsNoNumberThatFitsAWord) {
  EXPECT_TRUE(NaturalLess("1" + std::string(30, '0'), "2" + std::string(30, '0')));
  EXPECT_TRUE(NaturalLess("9", std::string(40, '1')));
}

}  // namespace
}  // namespace weft
