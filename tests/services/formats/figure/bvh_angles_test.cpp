#include "services/formats/figure/bvh_angles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr size_t kNumbers = 15;  // of a row: place and turn of the root, turns of three joints

// A limb of three bones of 10 each below the root.
BvhHierarchy Limb() {
  BvhHierarchy limb;
  for (int j = 0; j < 4; ++j) {
    limb.joints.push_back({"joint" + std::to_string(j), j - 1, {0, j == 0 ? 0.0 : 10.0, 0}, -1});
    std::vector<BvhChannel>& channels = limb.channels.emplace_back();
    if (j == 0) channels = {BvhChannel::kXPosition, BvhChannel::kYPosition, BvhChannel::kZPosition};
    channels.insert(channels.end(), {BvhChannel::kZRotation, BvhChannel::kXRotation, BvhChannel::kYRotation});
  }
  limb.numbers = kNumbers;
  return limb;
}

// Two rows between which the root goes this far; every joint turns by `turn` in the second.
std::vector<double> Rows(double way, double turn) {
  std::vector<double> values(2 * kNumbers);
  values[kNumbers] = way;
  for (const size_t channel : {6, 9, 12}) values[kNumbers + channel] = turn;
  return values;
}

TEST(BvhAngles, AngleBeyondAFullTurnOfRadiansAreDegrees) {
  const AngleJudgement judged = JudgeBvhAngles(Limb(), Rows(100, 30));
  EXPECT_FALSE(judged.are_radians);
  EXPECT_EQ(judged.note, "");
  // The root turns as the person does: by up to a full turn, and no more.
  std::vector<double> values = Rows(100, 1);
  values[kNumbers + 3] = -2 * std::numbers::pi;
  EXPECT_TRUE(JudgeBvhAngles(Limb(), values).are_radians);
  values[kNumbers + 3] = -6.3;
  EXPECT_FALSE(JudgeBvhAngles(Limb(), values).are_radians);
}

TEST(BvhAngles, WhoGoesSomewhereTurnsJointsByMoreThanSoManyDegrees) {
  // A step is a quarter of the reach, 30.
  const AngleJudgement goes = JudgeBvhAngles(Limb(), Rows(7.6, 1));
  EXPECT_TRUE(goes.are_radians);
  EXPECT_THAT(goes.note, HasSubstr("no angle is above 1 and the person goes somewhere"));
  EXPECT_THAT(goes.note, HasSubstr("--angles degrees"));
  const AngleJudgement stays = JudgeBvhAngles(Limb(), Rows(7.4, 1));
  EXPECT_FALSE(stays.are_radians);
  EXPECT_THAT(stays.note, HasSubstr("give --angles radians"));
}

TEST(BvhAngles, JointsThatWouldTurnTooFarOrHardlyAtAllAreDegrees) {
  for (const double turn : {0.09, 1.6}) {  // less than 6 degrees; more than a right angle
    const AngleJudgement judged = JudgeBvhAngles(Limb(), Rows(100, turn));
    EXPECT_FALSE(judged.are_radians) << turn;
    EXPECT_EQ(judged.note, "") << turn;
  }
  // One joint may turn further than half of them do.
  std::vector<double> values = Rows(100, 1);
  values[kNumbers + 12] = 2.5;
  EXPECT_TRUE(JudgeBvhAngles(Limb(), values).are_radians);
}

TEST(BvhAngles, TooFewJointsTellNothing) {
  BvhHierarchy short_limb = Limb();
  short_limb.joints.resize(2);
  short_limb.channels.resize(2);
  short_limb.numbers = 9;
  std::vector<double> values(2 * 9);
  values[9] = 100, values[9 + 6] = 1;
  EXPECT_FALSE(JudgeBvhAngles(short_limb, values).are_radians);
}

}  // namespace
}  // namespace weft
