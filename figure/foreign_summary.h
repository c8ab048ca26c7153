// What all poses of a foreign motion say about its skeleton.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "figure/retarget.h"

namespace weft {

// Means over the poses. "In its axes": in those of the foreign joint that moves ours, as it is turned in each
// pose. So no value but `body` depends on where the person is, and none on the rest pose. Zero: not known.
struct ForeignSummary {
  std::array<std::vector<int>, kJoints> ends;  // the foreign joints between which a bone of ours ends
  std::array<Eigen::Vector3d, kJoints> bone;   // from the joint to its end, in its axes
  std::array<Eigen::Vector3d, kJoints> hinge;  // of upper arms and thighs: around which the next bone bends
  std::array<double, kJoints> bend;            // the sine of how far, without regard to its axis
  std::array<Eigen::Matrix3d, kJoints> turn;   // against the nearest parent of ours that the file has
  Eigen::Vector3d hips, trunk;  // in the pelvis's axes: from left to right (ours); from the hips upwards
  Eigen::Vector3d shoulders;    // in the chest's axes: from left to right (ours)
  Eigen::Vector3d body;         // in the world, of length 1 in each pose: from the feet to the shoulders
  double hips_along_body = 0;   // the cosine between the two
  double leg_length = 0;        // from hip to ankle; to the knee where ankles are unknown
};

// Precondition: one pose or more, and what MatchJoints asks for is matched.
ForeignSummary Summarize(const ForeignMotion& motion, const JointMatch& match);

// Arms and legs without clavicles.
bool IsLimb(Joint joint);

// The nearest parent of ours that the file has; -1 of the pelvis.
int MatchedParent(const JointMatch& match, size_t joint);

// Where a bone ends in a posture: the middle of `ends`, which are not empty.
Eigen::Vector3d EndIn(const ForeignPosture& posture, const std::vector<int>& ends);

}  // namespace weft
