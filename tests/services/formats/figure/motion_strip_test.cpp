#include "services/formats/figure/motion_strip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <string>

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

// A hand stretched out to +x is on the right of a camera in front.
TEST(MotionStrip, IsNotMirrored) {
  const auto rightmost = [](const FigurePose& pose) {
    Motion motion;
    motion.poses.assign(61, pose);
    const std::string svg = MotionStripSvg(motion);
    double out = 0;
    for (size_t at = 0; (at = svg.find(" x2=\"", at)) != std::string::npos; ++at) {
      const double x = std::stod(svg.substr(at + 5));
      const double y = std::stod(svg.substr(svg.find(" y2=\"", at) + 5));
      if (y < 250) out = std::max(out, x);
    }
    return out;
  };
  FigurePose out_to_the_right, out_to_the_left;
  out_to_the_right.Of(Joint::kRightUpperArm) =
      Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  out_to_the_left.Of(Joint::kLeftUpperArm) =
      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  EXPECT_GT(rightmost(out_to_the_right), rightmost(out_to_the_left) + 20);
}

}  // namespace
}  // namespace weft
