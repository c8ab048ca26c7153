#include "figure/body_sides.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/angles.h"
#include "tests/figure/foreign_person.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Knees bend backwards, around the file's x, by `degrees`.
ForeignMotion Crouching(double degrees) {
  ForeignMotion out = TPose(5);
  for (ForeignMotion::Pose& pose : out.poses)
    for (const char* shin : {"LeftLeg", "RightLeg"})
      pose.rotation[IndexOf(out, shin)] = Eigen::AngleAxisd(kRadPerDeg * degrees, Eigen::Vector3d::UnitX());
  return out;
}

// As in a mirror whose plane is x = 0; names stay.
ForeignMotion Mirrored(ForeignMotion motion) {
  for (ForeignMotion::Joint& joint : motion.joints) joint.offset.x() *= -1;
  for (ForeignMotion::Pose& pose : motion.poses) {
    for (Eigen::Vector3d& place : pose.place) place.x() *= -1;
    for (Eigen::Quaterniond& turn : pose.rotation) turn.y() *= -1, turn.z() *= -1;
  }
  return motion;
}

std::string Refusal(const ForeignMotion& motion, std::vector<std::string>* notes = nullptr) {
  std::vector<std::string> own;
  return std::string(CheckSides(motion, *MatchJoints(motion), notes ? *notes : own).message());
}

TEST(BodySides, OfAPersonAreRight) {
  for (const double degrees : {0.0, 10.0, 90.0}) {
    std::vector<std::string> notes;
    EXPECT_EQ(Refusal(Crouching(degrees), &notes), "") << degrees;
    EXPECT_THAT(notes, IsEmpty()) << degrees;
  }
}

TEST(BodySides, OfAMirroredPersonAreRefused) {
  const ForeignMotion mirrored = Mirrored(Crouching(30));
  EXPECT_THAT(Refusal(mirrored), HasSubstr("--sides exchanged"));
  EXPECT_FALSE(Retarget(mirrored, *MatchJoints(mirrored)).ok());
  EXPECT_TRUE(Retarget(mirrored, *MatchJoints(mirrored), {.check_sides = false}).ok());
  // A mirrored person whose names are exchanged is the person that does the same with the other side.
  const JointMatch exchanged = WithSidesExchanged(*MatchJoints(mirrored));
  std::vector<std::string> notes;
  EXPECT_TRUE(CheckSides(mirrored, exchanged, notes).ok());
  EXPECT_THAT(notes, IsEmpty());
  const auto motion = Retarget(mirrored, exchanged),
             truth = Retarget(Crouching(30), *MatchJoints(Crouching(30)));
  ASSERT_TRUE(motion.ok() && truth.ok()) << motion.status() << truth.status();
  for (size_t j = 0; j < kJoints; ++j)
    EXPECT_LT(motion->motion.poses[0].rotation[j].angularDistance(truth->motion.poses[0].rotation[j]), 1e-6)
        << NameOf(static_cast<Joint>(j));
}

TEST(BodySides, WithOneSignAloneAreNoted) {
  ForeignMotion straight = Mirrored(Crouching(0));
  std::vector<std::string> notes;
  EXPECT_EQ(Refusal(straight, &notes), "");
  EXPECT_THAT(notes, ElementsAre(HasSubstr("toes point backwards")));
  ForeignMotion without_toes = Mirrored(Crouching(30));
  for (ForeignMotion::Joint& joint : without_toes.joints)
    if (joint.name.find("Toe") != std::string::npos) joint.offset.setZero();
  notes.clear();
  EXPECT_EQ(Refusal(without_toes, &notes), "");
  EXPECT_THAT(notes, ElementsAre(HasSubstr("knees bend forwards")));
}

TEST(BodySides, OfArmsAndLegsBelongTogether) {
  ForeignMotion arms = Crouching(30);
  for (const char* side : {"Left", "Right"})
    for (const char* joint : {"Shoulder", "Arm", "ForeArm", "Hand", "HandEnd"})
      arms.joints[IndexOf(arms, std::string(side) + joint)].offset.x() *= -1;
  EXPECT_THAT(Refusal(arms), HasSubstr("the arm called left is on the side of the leg called right"));
}

}  // namespace
}  // namespace weft
