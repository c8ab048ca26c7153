#include "figure/body.h"

#include <gtest/gtest.h>

#include <cmath>

#include "figure/joint_angles.h"
#include "simulation/body_motion.h"
#include "simulation/wardrobe.h"

namespace weft {
namespace {

using Eigen::Vector3d;

TEST(Body, NormalIsTheGradientOfTheDistance) {
  const Body body(NaturalPose());
  int near = 0;
  for (int k = 0; k < 2000; ++k) {
    const double angle = 0.7 * k;
    const Vector3d p(190 * std::cos(angle), -380 + 0.36 * k, 150 * std::sin(angle));
    const SurfaceDistance d = body.DistanceTo(p);
    if (std::abs(d.distance_mm) > 15) continue;
    ++near;
    // A step along the normal by the distance ends on the surface.
    const SurfaceDistance at = body.DistanceTo(p - d.distance_mm * d.normal);
    EXPECT_NEAR(at.distance_mm, 0, 2 + 0.2 * std::abs(d.distance_mm)) << p.transpose();
  }
  EXPECT_GT(near, 30);
}

TEST(Body, ShortReachGivesTheSameDistanceNearby) {
  const Body body(NaturalPose());
  for (int k = 0; k < 300; ++k) {
    const Vector3d p(150 * std::sin(1.3 * k), -350 + 2 * k, 110 * std::cos(1.3 * k));
    const double full = body.DistanceTo(p).distance_mm;
    if (full >= 10) continue;
    EXPECT_NEAR(body.DistanceWithin(p, 10).distance_mm, full, 1e-6);
  }
}

TEST(Body, MeshLiesOnTheSurfaceAndFacesOutwards) {
  const Body body(NaturalPose());
  const std::vector<Vector3d> x = body.MeshVertices();
  for (const Vector3d& p : x) EXPECT_LT(body.DistanceTo(p).distance_mm, 1);
  double volume = 0;  // of all parts together, positive for faces that are counter-clockwise from outside
  for (const Face& f : Body::MeshFaces()) volume += x[f[0]].dot(x[f[1]].cross(x[f[2]])) / 6;
  EXPECT_GT(volume, 3e7);
}

TEST(Body, ArmsMoveAsTheirAnglesSay) {
  BodyPose pose;
  pose.right.arm_out = std::acos(0);  // a quarter turn: straight to the side
  EXPECT_LT(Body(pose).DistanceTo({480, -275, 0}).distance_mm, 0);
  pose.right.arm_out = 0, pose.right.arm_forward = std::acos(0);
  EXPECT_LT(Body(pose).DistanceTo({172, -275, -400}).distance_mm, 0);
  EXPECT_GT(Body(BodyPose()).DistanceTo({480, -275, 0}).distance_mm, 0);
}

TEST(Body, MotionsMovePointsWhereTheirPartTakesThem) {
  BodyPose raised;
  raised.root_mm = {10, -20, 30};
  raised.right.arm_out = 1;
  const Body hanging{BodyPose()}, there(raised);
  for (const Vector3d& p : hanging.MeshVertices()) {
    const Eigen::Isometry3d motion = hanging.MotionTo(there, p);
    EXPECT_LT((motion * p - hanging.PlaceIn(there, p)).norm(), 1e-9);
    EXPECT_LT((motion.linear() * motion.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

TEST(Body, AFigureInTheNaturalPoseIsTheSameBody) {
  const std::vector<Vector3d> old = Body(NaturalPose()).MeshVertices();
  const std::vector<Vector3d> figure = Body(PoseOf(NaturalAngles())).MeshVertices();
  ASSERT_EQ(old.size(), figure.size());
  for (size_t v = 0; v < old.size(); ++v) EXPECT_LT((old[v] - figure[v]).norm(), 1e-6);
}

TEST(Body, ShapesChangeWhatTheyName) {
  const Body average(PoseOf(NaturalAngles()));
  BodyShape shape;
  shape.waist_girth = 1.2;
  const Body wide(PoseOf(NaturalAngles()), shape);
  const Vector3d beside(170, 20, 0), above(0, -600, -20);
  EXPECT_LT(wide.DistanceTo(beside).distance_mm, average.DistanceTo(beside).distance_mm - 5);
  EXPECT_NEAR(wide.DistanceTo(above).distance_mm, average.DistanceTo(above).distance_mm, 1e-9);
  shape = BodyShape();
  shape.stature = 1.1;
  const Body tall(PoseOf(NaturalAngles()), shape);
  EXPECT_LT(tall.DistanceTo(above).distance_mm, average.DistanceTo(above).distance_mm - 20);
}

TEST(BodyMotion, BeginsInTheNaturalPoseAndNeverJumps) {
  for (const PerformanceMotion motion :
       {PerformanceMotion::kBreathing, PerformanceMotion::kTwist, PerformanceMotion::kJogging,
        PerformanceMotion::kPinch, PerformanceMotion::kTwistAndPinch}) {
    const std::vector<Vector3d> natural = Body(NaturalPose()).MeshVertices();
    std::vector<Vector3d> before = Body(PoseAt(motion, 0, 1)).MeshVertices();
    for (size_t v = 0; v < natural.size(); ++v) EXPECT_EQ(before[v], natural[v]);
    double moved = 0;
    for (int k = 1; k <= 20; ++k) {
      const std::vector<Vector3d> x = Body(PoseAt(motion, 0.05 * k, 1)).MeshVertices();
      for (size_t v = 0; v < x.size(); v += 7) {
        // 6 m/s: a foot that jogs.
        ASSERT_LT((x[v] - before[v]).norm(), 300) << NameOf(motion) << " at " << 0.05 * k << " s";
        moved = std::max(moved, (x[v] - natural[v]).norm());
      }
      before = x;
    }
    EXPECT_GT(moved, 4) << NameOf(motion);
  }
}

TEST(BodyMotion, HandHoldsWhileItPulls) {
  const Vector3d rest(10, 20, -130);
  double farthest = 0;
  EXPECT_FALSE(PinchAt(PerformanceMotion::kPinch, 0, rest, 1).holds);
  for (int k = 0; k < 320; ++k) {
    const PinchState state = PinchAt(PerformanceMotion::kPinch, 0.01 * k, rest, 1);
    if (state.holds) farthest = std::max(farthest, (state.hand.grip_mm - rest).norm());
  }
  EXPECT_GT(farthest, 30);
}

TEST(BodyMotion, HandStaysAwayWhileTheTrunkTwistsAndComesWithoutAJump) {
  const Vector3d rest(10, 20, -130);
  Vector3d before = PinchAt(PerformanceMotion::kTwistAndPinch, 0, rest, 1).hand.grip_mm;
  double twist = 0;
  for (int k = 1; k < 600; ++k) {
    const PinchState state = PinchAt(PerformanceMotion::kTwistAndPinch, 0.01 * k, rest, 1);
    EXPECT_LT((state.hand.grip_mm - before).norm(), 12) << k;  // 1.2 m/s
    before = state.hand.grip_mm;
    const double now = std::abs(PoseAt(PerformanceMotion::kTwistAndPinch, 0.01 * k, 1).twist);
    if (state.is_away) twist = std::max(twist, now);
    if (state.holds) {
      EXPECT_LT(now, 0.1) << k;
    }
  }
  EXPECT_GT(twist, 0.4);
}

TEST(Hand, DistancesAreToItsMeshAndPlacesMoveWithItsBones) {
  const Hand hand({{10, 20, 30}, {0, 0, -1}, 20}), closed({{10, 20, 30}, {0, 0, -1}, 5});
  for (const Vector3d& p : hand.MeshVertices()) EXPECT_LT(hand.DistanceTo(p).distance_mm, 0.3);
  const std::array<Vector3d, 2> tips = hand.Tips(), closed_tips = closed.Tips();
  for (int t = 0; t < 2; ++t) {
    EXPECT_LT(hand.DistanceTo(tips[t]).distance_mm, -6);
    EXPECT_LT((hand.PlaceIn(closed, tips[t]) - closed_tips[t]).norm(), 1e-9);
  }
  EXPECT_NEAR((tips[0] - tips[1]).norm() - (closed_tips[0] - closed_tips[1]).norm(), 15, 1e-9);
}

}  // namespace
}  // namespace weft
