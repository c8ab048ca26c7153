// Motions of other skeletons, as motion capture delivers them, on ours.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "figure/motion.h"

namespace weft {

// A skeleton of named joints that moves. Its rest pose is upright with any arms, along the axes of its world;
// which axis is up, and where the person looks, follow from the rest pose. Lengths have any unit.
struct ForeignMotion {
  struct Joint {
    std::string name;
    int parent = -1;                                   // before the joint; -1 of the root, which is the first
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // from the parent, at rest
  };
  struct Pose {
    Eigen::Vector3d root = Eigen::Vector3d::Zero();
    std::vector<Eigen::Quaterniond> rotation;  // [joints], against the parent; the root's against the world
  };
  double fps = 0;
  std::vector<Joint> joints;
  std::vector<Pose> poses;
};

// Which foreign joint moves ours, as indices; -1 where none does.
struct JointMatch {
  std::array<int, kJoints> of;
  std::array<int, 2> ankles;  // left, right
};

// Matches by the names that are in use (Biovision, CMU, Poser, Mixamo), capitals and prefixes aside; chest
// and clavicles by where the arms branch off. `given` maps names of ours (NameOf) to names in the file, and
// goes first. A left arm of the file is on the side of +x, which is "right" in our names (skeleton.h).
// InvalidArgument lists what is missing, with the file's names and the remedy.
absl::StatusOr<JointMatch> MatchJoints(const ForeignMotion& motion,
                                       const std::map<std::string, std::string>& given = {});

// The motion on an average person: scaled by the length of the legs, on the ground, looking towards -z at the
// first pose, whose pelvis is at x = z = 0. Limbs point where the file's point; how far they turn around
// themselves counts from its rest pose. Limits of joints are not enforced. InvalidArgument: a rest pose that
// is not upright, legs without length, and what Motion::Validate refuses.
absl::StatusOr<Motion> Retarget(const ForeignMotion& motion, const JointMatch& match);

}  // namespace weft
