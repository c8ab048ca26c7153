#include "services/figure/motion_strip.h"

#include <gtest/gtest.h>

#include <numbers>

namespace weft {
namespace {

TEST(MotionStrip, TellsHowFarAndFastJointsTurn) {
  Motion motion;
  motion.fps = 10;
  for (int k = 0; k < 3; ++k) {
    FigurePose pose;
    pose.Of(Joint::kHead) = Eigen::AngleAxisd(k * std::numbers::pi / 18, Eigen::Vector3d::UnitX());
    motion.poses.push_back(pose);
  }
  const auto uses = JointUses(motion);
  EXPECT_NEAR(uses[static_cast<size_t>(Joint::kHead)].farthest_deg, 20, 1e-6);
  EXPECT_NEAR(uses[static_cast<size_t>(Joint::kHead)].fastest_deg_s, 100, 1e-6);
  EXPECT_NEAR(uses[static_cast<size_t>(Joint::kLeftHand)].farthest_deg, 0, 1e-6);
}

TEST(MotionStrip, DrawsTwelveMomentsFromTwoSides) {
  Motion motion;
  motion.poses.resize(61);
  const std::string svg = MotionStripSvg(motion);
  size_t labels = 0, bones = 0;
  for (size_t at = 0; (at = svg.find("<text", at)) != std::string::npos; ++at) ++labels;
  for (size_t at = 0; (at = svg.find("<line", at)) != std::string::npos; ++at) ++bones;
  EXPECT_EQ(labels, 12u);
  EXPECT_EQ(bones, 12u * 2 * (kJoints - 1 + 5));
  EXPECT_NE(svg.find("1.00 s"), std::string::npos);
}

}  // namespace
}  // namespace weft
