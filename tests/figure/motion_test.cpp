#include "figure/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// A chest that turns evenly, a root that goes along a parabola.
Motion EvenTurn() {
  Motion motion;
  motion.fps = 10;
  for (int k = 0; k < 8; ++k) {
    FigurePose pose;
    pose.root_mm.x() = k * k;
    pose.Of(Joint::kChest) = Quaterniond(AngleAxisd(0.2 * k, Vector3d::UnitY()));
    if (k % 2 == 1) pose.Of(Joint::kChest).coeffs() *= -1;  // the same turn
    motion.poses.push_back(pose);
  }
  return motion;
}

TEST(Motion, KeepsItsPosesAndIsSmoothBetween) {
  const Motion motion = EvenTurn();
  for (int k = 0; k < 8; ++k) {
    const FigurePose pose = motion.PoseAt(k / 10.0);
    EXPECT_NEAR(pose.root_mm.x(), k * k, 1e-9);
    EXPECT_NEAR(pose.Of(Joint::kChest).angularDistance(motion.poses[k].Of(Joint::kChest)), 0, 1e-7);
  }
  // Parabolas are exact inside, turns to a thousandth.
  const FigurePose between = motion.PoseAt(0.35);
  EXPECT_NEAR(between.root_mm.x(), 3.5 * 3.5, 1e-9);
  EXPECT_NEAR(between.Of(Joint::kChest).angularDistance(Quaterniond::Identity()), 0.7, 1e-3);
  // No corner at a pose: the speeds on both sides agree.
  const auto x = [&](double t) { return motion.PoseAt(t).root_mm.x(); };
  EXPECT_NEAR((x(0.3) - x(0.2999)) / 1e-4, (x(0.3001) - x(0.3)) / 1e-4, 0.1);
}

TEST(Motion, StandsStillBeforeAndAfter) {
  const Motion motion = EvenTurn();
  EXPECT_EQ(motion.PoseAt(-5).root_mm, motion.poses.front().root_mm);
  EXPECT_EQ(motion.PoseAt(99).root_mm, motion.poses.back().root_mm);
  Motion single;
  single.poses.resize(1);
  EXPECT_EQ(single.PoseAt(3).root_mm, Vector3d::Zero());
}

TEST(Motion, WhatCannotBeIsNamed) {
  const auto message = [](const Motion& motion) { return std::string(motion.Validate().message()); };
  EXPECT_TRUE(EvenTurn().Validate().ok());
  EXPECT_NE(message(Motion()).find("no pose"), std::string::npos);
  Motion motion = EvenTurn();
  motion.fps = 0;
  EXPECT_NE(message(motion).find("fps is 0"), std::string::npos);
  motion = EvenTurn();
  motion.poses[3].Of(Joint::kHead).coeffs() *= 2;
  EXPECT_NE(message(motion).find("pose 3: the quaternion of head"), std::string::npos);
  motion = EvenTurn();
  motion.poses[2].root_mm.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(motion).find("pose 2: root_mm"), std::string::npos);
}

}  // namespace
}  // namespace weft
