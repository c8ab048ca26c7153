// Motions of other skeletons, as motion capture delivers them, on ours.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "figure/motion.h"

namespace weft {

// A skeleton of named joints that moves. Any axis of its world may be up, joints may have any axes and any
// rest pose, and more joints may be above the pelvis. Lengths have any unit.
struct ForeignMotion {
  struct Joint {
    std::string name;                                  // none: the end of a limb
    int parent = -1;                                   // before the joint; -1 of the root, which is the first
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // from the parent, in the parent's axes
    int place = -1;                                    // into Pose::place; -1: always at its offset
  };
  struct Pose {
    std::vector<Eigen::Quaterniond> rotation;  // [joints], against the parent; the root's against the world
    std::vector<Eigen::Vector3d> place;  // instead of the offset, of joints that move against their parent
  };
  double fps = 0;
  std::vector<Joint> joints;
  std::vector<Pose> poses;
  std::vector<std::string> notes;  // what was read otherwise than the file says, a sentence each
};

// Where joints are in their world, and how they are turned: forward kinematics.
struct ForeignPosture {
  std::vector<Eigen::Vector3d> at;
  std::vector<Eigen::Quaterniond> rotation;
};
ForeignPosture PostureOf(const ForeignMotion& motion, const ForeignMotion::Pose& pose);

// Which foreign joint moves ours, as indices; -1 where none does.
struct JointMatch {
  std::array<int, kJoints> of = {};
  std::array<int, 2> ankles = {-1, -1};  // left, right
};

// Matches by the names that are in use (Biovision, CMU, Poser, Mixamo, 3ds Max, Unreal, SMPL), capitals and
// common prefixes aside; chest and clavicles by where the arms branch off. `given` maps names of ours
// (NameOf) to names in the file, and goes first. A left arm of the file is on the side of +x, which is
// "right" in our names (skeleton.h). InvalidArgument: what is missing, two joints of one name, one joint for
// two of ours, and limbs with a joint in between that may be the one that is meant; with the file's names and
// the remedy.
absl::StatusOr<JointMatch> MatchJoints(const ForeignMotion& motion,
                                       const std::map<std::string, std::string>& given = {});

struct RetargetOptions {
  std::optional<Eigen::Vector3d> up;  // an axis of the file's world; else from the poses
  bool check_sides = true;            // CheckSides (body_sides.h)
};

struct RetargetedMotion {
  Motion motion;
  Eigen::Vector3d up;     // the axis of the file's world
  double leg_length = 0;  // from hip to ankle, in the file's unit; to the knee where it has no ankles
  std::vector<std::string> notes;  // what a person should look at, a sentence each
};

// The motion on an average person: scaled by the length of the legs, on the ground, looking towards -z at the
// first pose, whose pelvis is at x = z = 0. Limbs point where the file's joints are in its poses, whatever
// its rest pose is. How far they turn around themselves counts from the rest pose where that stands upright,
// else from the plane in which elbows and knees bend. Limits of joints are not enforced. InvalidArgument:
// poses that do not tell which axis is up, legs without length, sides that are exchanged, and what
// Motion::Validate refuses.
absl::StatusOr<RetargetedMotion> Retarget(const ForeignMotion& motion, const JointMatch& match,
                                          const RetargetOptions& options = {});

}  // namespace weft
