// A person of another program in T pose, y up, looking towards +z, the left arm along +x; names as Mixamo's,
// lengths in cm.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "figure/retarget.h"

namespace weft {

inline ForeignMotion TPose(int poses = 1) {
  ForeignMotion out;
  out.fps = 30;
  const auto add = [&](const std::string& name, int parent, const Eigen::Vector3d& offset) {
    out.joints.push_back({"mixamorig:" + name, parent, offset});
    return static_cast<int>(out.joints.size()) - 1;
  };
  const int hips = add("Hips", -1, {0, 0, 0});
  const int spine = add("Spine", hips, {0, 10, 0}), chest = add("Spine1", spine, {0, 20, 0});
  add("Head", chest, {0, 30, 0});
  for (const double side : {1.0, -1.0}) {
    const std::string name = side > 0 ? "Left" : "Right";
    const int shoulder = add(name + "Shoulder", chest, {5 * side, 15, 0});
    const int arm = add(name + "Arm", shoulder, {12 * side, 0, 0});
    const int forearm = add(name + "ForeArm", arm, {28 * side, 0, 0});
    const int hand = add(name + "Hand", forearm, {25 * side, 0, 0});
    add(name + "HandEnd", hand, {10 * side, 0, 0});
    const int thigh = add(name + "UpLeg", hips, {9 * side, -4, 0});
    const int shin = add(name + "Leg", thigh, {0, -41.5, 0});
    const int foot = add(name + "Foot", shin, {0, -41.5, 0});
    add(name + "ToeBase", foot, {0, -5, 12});
  }
  out.joints[0].place = 0;
  out.poses.resize(static_cast<size_t>(poses));
  for (ForeignMotion::Pose& pose : out.poses) {
    pose.place = {{0, 90, 0}};
    pose.rotation.assign(out.joints.size(), Eigen::Quaterniond::Identity());
  }
  return out;
}

inline size_t IndexOf(const ForeignMotion& motion, const std::string& name) {
  for (size_t k = 0; k < motion.joints.size(); ++k)
    if (motion.joints[k].name == "mixamorig:" + name) return k;
  ADD_FAILURE() << name;
  return 0;
}

// Where a bone of ours points that hangs down at rest.
inline Eigen::Vector3d Direction(const FigurePose& pose, Joint joint) {
  return WorldFromRest(SkeletonOf(BodyShape()), pose)[static_cast<size_t>(joint)].linear() *
         Eigen::Vector3d::UnitY();
}

}  // namespace weft
