// How a person stands.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "figure/skeleton.h"

namespace weft {

// At rest: upright, arms straight down.
struct FigurePose {
  Eigen::Vector3d root_mm = Eigen::Vector3d::Zero();  // of the pelvis
  // Of each joint against its parent's axes; the pelvis's against the world's. Axes of all are the world's at
  // rest.
  std::array<Eigen::Quaterniond, kJoints> rotation;

  FigurePose() { rotation.fill(Eigen::Quaterniond::Identity()); }
  Eigen::Quaterniond& Of(Joint joint) { return rotation[static_cast<size_t>(joint)]; }
  const Eigen::Quaterniond& Of(Joint joint) const { return rotation[static_cast<size_t>(joint)]; }
};

// share 0: a, 1: b; rotations along their shortest arcs.
FigurePose Mix(const FigurePose& a, const FigurePose& b, double share);

// world_from_rest of each joint: moves what is given at rest, in mm relative to the pelvis.
std::array<Eigen::Isometry3d, kJoints> WorldFromRest(const Skeleton& skeleton, const FigurePose& pose);

}  // namespace weft
