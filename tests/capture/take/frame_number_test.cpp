#include "capture/take/frame_number.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::Optional;

TEST(FrameNumber, ReadsTheNumberInWhichNamesDiffer) {
  EXPECT_THAT(FrameNumbers({"0000", "0007", "12"}), Optional(ElementsAre(0, 7, 12)));
  EXPECT_THAT(FrameNumbers({"frame_1", "frame_20"}), Optional(ElementsAre(1, 20)));
  EXPECT_THAT(FrameNumbers({"a2_001.rgb", "a2_002.rgb"}), Optional(ElementsAre(1, 2)));
  EXPECT_THAT(FrameNumbers({"0.5", "1.25", "12.125"}), Optional(ElementsAre(500, 1250, 12125)));
  EXPECT_THAT(FrameNumbers({"t_1623840123.45", "t_1623840123.5"}),
              Optional(ElementsAre(162384012345, 162384012350)));
  EXPECT_THAT(FrameNumbers({"9223372036854775807"}), Optional(ElementsAre(INT64_MAX)));
}

TEST(FrameNumber, SaysWhereNamesHaveNone) {
  EXPECT_EQ(FrameNumbers({}), std::nullopt);
  EXPECT_EQ(FrameNumbers({"a1", "b2"}), std::nullopt);
  EXPECT_EQ(FrameNumbers({"-1", "0"}), std::nullopt);
  EXPECT_EQ(FrameNumbers({"walk"}), std::nullopt);
  EXPECT_EQ(FrameNumbers({"9223372036854775808"}), std::nullopt);
  EXPECT_EQ(FrameNumbers({"99999999999999999999999999"}), std::nullopt);
}

TEST(FrameSteps, CountsInUsualSteps) {
  const FrameSteps gap({"0000", "0001", "0002", "0010", "0011"});
  EXPECT_EQ(gap.Between(0, 1), 1);
  EXPECT_EQ(gap.Between(2, 3), 8);
  EXPECT_EQ(gap.Between(3, 2), -8);
  EXPECT_EQ(gap.Between(1, 3), 9);
  const FrameSteps every_third({"0000", "0003", "0006", "0015"});
  EXPECT_EQ(every_third.Between(0, 2), 2);
  EXPECT_EQ(every_third.Between(2, 3), 3);
  const FrameSteps two({"0", "10", "11"});  // gaps are the exception
  EXPECT_EQ(two.Between(0, 1), 10);
  const FrameSteps times(
      {"1623840123456789012", "1623840123490122345", "1623840123523455678", "1623840123623455678"});
  EXPECT_EQ(times.Between(0, 2), 2);
  EXPECT_EQ(times.Between(2, 3), 3);
}

TEST(FrameSteps, CountsPositionsWhereNamesHaveNoNumbers) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"a", "b", "x9"}, {"-1", "0", "1"}, {"2", "1", "0"}, {"1", "01", "2"}}) {
    const FrameSteps steps(names);
    EXPECT_EQ(steps.Between(0, 2), 2) << names[0];
    EXPECT_EQ(steps.Between(2, 1), -1) << names[0];
  }
  EXPECT_EQ(FrameSteps({"7"}).Between(0, 0), 0);
}

TEST(FrameSteps, HasNoOverflow) {
  const FrameSteps steps({"0", "1", "9223372036854775807"});
  EXPECT_EQ(steps.Between(0, 2), INT64_MAX);
  EXPECT_EQ(steps.Between(2, 0), -INT64_MAX);
  const FrameSteps far({"0", "9223372036854775807"});
  EXPECT_EQ(far.Between(0, 1), 1);
}

}  // namespace
}  // namespace weft
