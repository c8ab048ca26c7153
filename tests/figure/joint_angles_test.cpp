#include "figure/joint_angles.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

using Eigen::Vector3d;

Vector3d At(const FigurePose& pose, Joint joint) {
  static const Skeleton skeleton = SkeletonOf(BodyShape());
  return WorldFromRest(skeleton, pose)[static_cast<size_t>(joint)] * skeleton.At(joint);
}

TEST(JointAngles, PointWhereTheirNamesSay) {
  const JointAngles rest;
  const auto moved = [&](JointAngle angle, BodySide side, Joint joint) -> Vector3d {
    JointAngles angles;
    angles.Of(angle, side) = 20;
    return At(PoseOf(angles), joint) - At(PoseOf(rest), joint);
  };
  using enum JointAngle;
  const auto left = BodySide::kLeft, right = BodySide::kRight;
  EXPECT_LT(moved(kArmForward, left, Joint::kLeftHand).z(), -50);
  EXPECT_LT(moved(kArmOut, left, Joint::kLeftHand).x(), -50);
  EXPECT_GT(moved(kArmOut, right, Joint::kRightHand).x(), 50);
  EXPECT_LT(moved(kElbow, right, Joint::kRightHand).z(), -50);
  EXPECT_LT(moved(kLegForward, right, Joint::kRightShin).z(), -50);
  EXPECT_GT(moved(kLegOut, right, Joint::kRightShin).x(), 50);
  EXPECT_LT(moved(kSpineLean, left, Joint::kHead).z(), -50);
  EXPECT_GT(moved(kSpineSide, left, Joint::kHead).x(), 50);
  EXPECT_LT(moved(kClavicleRaise, left, Joint::kLeftUpperArm).y(), -20);
  EXPECT_LT(moved(kClavicleForward, right, Joint::kRightUpperArm).z(), -20);
  // A twist to the left brings the right shoulder forwards.
  EXPECT_LT(moved(kChestTwist, left, Joint::kRightUpperArm).z(), -20);
  EXPECT_LT(moved(kPelvisTurn, left, Joint::kRightUpperArm).z(), -20);
}

TEST(JointAngles, LimitsHoldOnBothSides) {
  JointAngles angles;
  angles.deg.fill(1e3);
  angles = WithinLimits(angles);
  for (size_t k = 0; k < kAngles; ++k) EXPECT_EQ(angles.deg[k], LimitOf(k).high_deg);
  EXPECT_EQ(LimitOf(JointAngles::IndexOf(JointAngle::kKnee, BodySide::kLeft)).high_deg,
            LimitOf(JointAngles::IndexOf(JointAngle::kKnee, BodySide::kRight)).high_deg);
}

TEST(JointAngles, AnArmInTheTrunkIsRaisedUntilItIsClear) {
  JointAngles angles = NaturalAngles();
  EXPECT_EQ(ClearArmOut(angles, BodySide::kLeft, 12), angles.Of(JointAngle::kArmOut, BodySide::kLeft));
  // Straight down the arm is partly in the hip.
  angles.Of(JointAngle::kArmOut, BodySide::kLeft) = 0;
  const double clear = ClearArmOut(angles, BodySide::kLeft, 12);
  EXPECT_GT(clear, 1);
  EXPECT_LT(clear, 30);
  // The answer hardly depends on where the search began.
  angles.Of(JointAngle::kArmOut, BodySide::kLeft) = 0.5;
  EXPECT_NEAR(ClearArmOut(angles, BodySide::kLeft, 12), clear, 0.1);
}

}  // namespace
}  // namespace weft
