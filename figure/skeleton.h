// The joints of a person, and the sizes in which people differ.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absl/status/status.h"

namespace weft {

// "Left" is the side of -x: a person looks towards -z, y is down.
enum class Joint : uint8_t {
  kPelvis,
  kSpine,
  kChest,
  kHead,
  kLeftClavicle,
  kLeftUpperArm,
  kLeftForearm,
  kLeftHand,
  kRightClavicle,
  kRightUpperArm,
  kRightForearm,
  kRightHand,
  kLeftThigh,
  kLeftShin,
  kRightThigh,
  kRightShin,
};
inline constexpr int kJoints = 16;

// "pelvis", "spine", ... "left-upper-arm", ...
std::string_view NameOf(Joint joint);
std::optional<Joint> JointNamed(std::string_view name);
// The pelvis is its own parent; all others come after their parents.
Joint ParentOf(Joint joint);

// Factors against an average person of 1.80 m, whose factors are 1. Lengths and girths grow with the stature
// as well.
struct BodyShape {
  double stature = 1;
  double torso_length = 1;
  double arm_length = 1;
  double leg_length = 1;
  double shoulder_width = 1;
  double neck_girth = 1;
  double chest_girth = 1;
  double waist_girth = 1;
  double hip_girth = 1;
  double arm_girth = 1;
  double leg_girth = 1;
  double belly_depth = 1;  // of the trunk, front to back

  bool operator==(const BodyShape&) const = default;
  // InvalidArgument names a factor that is not within 0.7 to 1.4.
  absl::Status Validate() const;
};

struct BodyFactor {
  std::string_view name;  // as the field's
  double BodyShape::*value;
};
inline constexpr int kBodyFactors = 12;
const std::array<BodyFactor, kBodyFactors>& BodyFactors();

// A person as they come: girths vary together, by 7 % in the standard deviation, lengths by 3 %, with 2 and 3
// % of each for itself. Factors stay within 0.85 to 1.2.
BodyShape RandomBodyShape(uint64_t seed);

// Where joints are at rest (upright, arms straight down), relative to the pelvis.
struct Skeleton {
  std::array<Eigen::Vector3d, kJoints> rest_mm;
  Eigen::Vector3d left_ankle_mm, right_ankle_mm;  // ends of the legs

  const Eigen::Vector3d& At(Joint joint) const { return rest_mm[static_cast<size_t>(joint)]; }
};
Skeleton SkeletonOf(const BodyShape& shape);

}  // namespace weft
