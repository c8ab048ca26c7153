#include "figure/motion_generator.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "figure/choreography.h"
#include "figure/joint_angles.h"

namespace weft {
namespace {

Motion Make(MotionKind kind, uint64_t seed) {
  const absl::StatusOr<Motion> motion = MakeMotion({kind, 12, 60, seed});
  EXPECT_TRUE(motion.ok()) << motion.status();
  return *motion;
}

TEST(MotionGenerator, EveryKindIsSmoothValidAndStandsOnTheGround) {
  const Skeleton skeleton = SkeletonOf(BodyShape());
  for (const MotionKindInfo& info : MotionKinds()) {
    const Motion motion = Make(info.kind, 4);
    ASSERT_TRUE(motion.Validate().ok()) << info.name;
    ASSERT_EQ(motion.poses.size(), 721u);
    double farthest = 0;
    Eigen::Vector3d before;
    for (size_t k = 0; k < motion.poses.size(); ++k) {
      const auto world = WorldFromRest(skeleton, motion.poses[k]);
      const Eigen::Vector3d hand =
          world[static_cast<size_t>(Joint::kLeftHand)] * skeleton.At(Joint::kLeftHand);
      if (k > 0) {
        ASSERT_LT((hand - before).norm() * motion.fps, 4500) << info.name << " at pose " << k;  // mm/s
      }
      before = hand;
      const double ankle =
          std::max((world[static_cast<size_t>(Joint::kLeftShin)] * skeleton.left_ankle_mm).y(),
                   (world[static_cast<size_t>(Joint::kRightShin)] * skeleton.right_ankle_mm).y());
      const double above = skeleton.left_ankle_mm.y() - ankle;
      EXPECT_GT(above, -1e-6) << info.name;
      EXPECT_LT(above, info.kind == MotionKind::kJogging || info.kind == MotionKind::kMixed ? 70 : 5)
          << info.name;
      const double turned =
          motion.poses[k].Of(Joint::kLeftUpperArm).angularDistance(motion.poses[0].Of(Joint::kLeftUpperArm));
      farthest = std::max(farthest, turned);
    }
    EXPECT_GT(farthest, 0.05) << info.name;
  }
}

TEST(MotionGenerator, ArmsStayClearOfTheTrunk) {
  // The pose is what ClearArmOut leaves alone; checked on the angles that the poses are made of.
  for (const MotionKind kind : {MotionKind::kSpline, MotionKind::kReach}) {
    const Choreography moves = MakeChoreography(kind, 12, 4);
    int raised = 0;
    for (int k = 0; k < 200; ++k) {
      const JointAngles angles = WithinLimits(moves(0.06 * k).angles);
      raised += ClearArmOut(angles, BodySide::kRight, 12) > angles.Of(JointAngle::kArmOut, BodySide::kRight)
                    ? 1
                    : 0;
    }
    if (kind == MotionKind::kSpline) {
      EXPECT_GT(raised, 0) << "the random motion never needs it, so this test shows nothing";
    }
  }
}

TEST(MotionGenerator, SeedsDecide) {
  EXPECT_EQ(Make(MotionKind::kSpline, 1).poses[300].Of(Joint::kChest).coeffs(),
            Make(MotionKind::kSpline, 1).poses[300].Of(Joint::kChest).coeffs());
  EXPECT_NE(Make(MotionKind::kSpline, 1).poses[300].Of(Joint::kChest).coeffs(),
            Make(MotionKind::kSpline, 2).poses[300].Of(Joint::kChest).coeffs());
}

TEST(MotionGenerator, TheKindsKeptForTestsAreNotInTheMix) {
  // A squat lowers the root by more than 200 mm; nothing that is mixed does.
  double lowest = 0, of_squat = 0;
  for (uint64_t seed = 0; seed < 5; ++seed)
    for (const FigurePose& pose : Make(MotionKind::kMixed, seed).poses)
      lowest = std::max(lowest, pose.root_mm.y());
  for (const FigurePose& pose : Make(MotionKind::kSquat, 1).poses)
    of_squat = std::max(of_squat, pose.root_mm.y());
  EXPECT_LT(lowest, 150);
  EXPECT_GT(of_squat, 200);
}

TEST(MotionGenerator, WrongOptionsAreNamed) {
  EXPECT_NE(MotionKindNamed("hop").status().message().find("standing, twist"), std::string::npos);
  EXPECT_EQ(*MotionKindNamed("squat"), MotionKind::kSquat);
  EXPECT_NE(MakeMotion({MotionKind::kWalk, -1, 60, 1}).status().message().find("seconds is -1"),
            std::string::npos);
  EXPECT_NE(MakeMotion({MotionKind::kWalk, 1, 5, 1}).status().message().find("fps is 5"), std::string::npos);
}

}  // namespace
}  // namespace weft
