#include "figure/skeleton.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/counter_random.h"

namespace weft {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, kJoints> kNames = {
    "pelvis",         "spine",           "chest",         "head",
    "left-clavicle",  "left-upper-arm",  "left-forearm",  "left-hand",
    "right-clavicle", "right-upper-arm", "right-forearm", "right-hand",
    "left-thigh",     "left-shin",       "right-thigh",   "right-shin"};

using enum Joint;
constexpr std::array<Joint, kJoints> kParents = {kPelvis, kPelvis,        kSpine,         kChest,
                                                 kChest,  kLeftClavicle,  kLeftUpperArm,  kLeftForearm,
                                                 kChest,  kRightClavicle, kRightUpperArm, kRightForearm,
                                                 kPelvis, kLeftThigh,     kPelvis,        kRightThigh};

}  // namespace

std::string_view NameOf(Joint joint) { return kNames[static_cast<size_t>(joint)]; }

std::optional<Joint> JointNamed(std::string_view name) {
  const auto at = std::find(kNames.begin(), kNames.end(), name);
  if (at == kNames.end()) return std::nullopt;
  return static_cast<Joint>(at - kNames.begin());
}

Joint ParentOf(Joint joint) { return kParents[static_cast<size_t>(joint)]; }

const std::array<BodyFactor, kBodyFactors>& BodyFactors() {
  static constexpr std::array<BodyFactor, kBodyFactors> factors = {{
      {"stature", &BodyShape::stature},
      {"torso_length", &BodyShape::torso_length},
      {"arm_length", &BodyShape::arm_length},
      {"leg_length", &BodyShape::leg_length},
      {"shoulder_width", &BodyShape::shoulder_width},
      {"neck_girth", &BodyShape::neck_girth},
      {"chest_girth", &BodyShape::chest_girth},
      {"waist_girth", &BodyShape::waist_girth},
      {"hip_girth", &BodyShape::hip_girth},
      {"arm_girth", &BodyShape::arm_girth},
      {"leg_girth", &BodyShape::leg_girth},
      {"belly_depth", &BodyShape::belly_depth},
  }};
  return factors;
}

absl::Status BodyShape::Validate() const {
  for (const BodyFactor& factor : BodyFactors()) {
    const double value = this->*factor.value;
    if (value >= 0.7 && value <= 1.4) continue;
    return absl::InvalidArgumentError(absl::StrCat("body: ", std::string(factor.name), " is ", value,
                                                   ", expected 0.7 to 1.4 (1 is average)"));
  }
  return absl::OkStatus();
}

BodyShape RandomBodyShape(uint64_t seed) {
  constexpr double kStature = 0.04, kGirth = 0.07, kLength = 0.02, kOwn = 0.03;
  const uint64_t key = KeyOf(seed, "body shape");
  const double girth = kGirth * NormalOf(key, 0), length = kLength * NormalOf(key, 1);
  BodyShape out;
  uint64_t k = 2;
  for (const BodyFactor& factor : BodyFactors()) {
    const bool is_girth = factor.name.ends_with("girth") || factor.name == "belly_depth";
    const double common = factor.name == "stature" ? kStature * NormalOf(key, k) : is_girth ? girth : length;
    ++k;
    const double own = (is_girth ? kOwn : kLength) * NormalOf(key, k++);
    out.*factor.value = std::clamp(1 + common + own, 0.85, 1.2);
  }
  return out;
}

Skeleton SkeletonOf(const BodyShape& shape) {
  const double height = shape.stature;
  const auto trunk = [&](double x, double y, double z) -> Vector3d {
    return height * Vector3d(x, y * shape.torso_length, z);
  };
  Skeleton out;
  const auto set = [&](Joint joint, const Vector3d& at) { out.rest_mm[static_cast<size_t>(joint)] = at; };
  set(kPelvis, Vector3d::Zero());
  set(kSpine, trunk(0, 60, 0));
  set(kChest, trunk(0, -60, 0));
  set(kHead, trunk(0, -400, -8));
  struct Half {
    double sign;
    Joint clavicle, thigh;
    Vector3d Skeleton::*ankle;
  };
  for (const Half& side : {Half{-1, kLeftClavicle, kLeftThigh, &Skeleton::left_ankle_mm},
                           Half{1, kRightClavicle, kRightThigh, &Skeleton::right_ankle_mm}}) {
    const auto after = [](Joint joint, int k) { return static_cast<Joint>(static_cast<int>(joint) + k); };
    set(side.clavicle, trunk(side.sign * 20 * shape.shoulder_width, -300, 0));
    const Vector3d shoulder = trunk(side.sign * 172 * shape.shoulder_width, -275, 0);
    const Vector3d down = height * shape.arm_length * Vector3d::UnitY();
    set(after(side.clavicle, 1), shoulder);
    set(after(side.clavicle, 2), shoulder + 290 * down);
    set(after(side.clavicle, 3), shoulder + (290 + 255) * down);
    const Vector3d hip = height * Vector3d(side.sign * 82, 210, 0);
    const Vector3d leg = height * shape.leg_length * Vector3d::UnitY();
    set(side.thigh, hip);
    set(after(side.thigh, 1), hip + 420 * leg);
    out.*side.ankle = hip + (420 + 410) * leg;
  }
  return out;
}

}  // namespace weft
