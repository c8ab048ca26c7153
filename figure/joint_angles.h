// A pose in the angles of anatomy, with what joints allow.
#pragma once

#include <array>
#include <cstddef>

#include "figure/pose.h"

namespace weft {

// From kClavicleRaise on there is one on each side.
enum class JointAngle : int {
  kPelvisTurn,  // to the left, around the vertical
  kPelvisTilt,  // forwards
  kPelvisList,  // to the right
  kSpineLean,   // forwards
  kSpineSide,   // to the right
  kSpineTwist,  // to the left
  kChestLean,
  kChestSide,
  kChestTwist,
  kHeadNod,  // forwards
  kHeadSide,
  kHeadTurn,
  kClavicleRaise,
  kClavicleForward,
  kArmForward,
  kArmOut,
  kArmInward,  // around its own axis
  kElbow,
  kForearmTurn,
  kWrist,
  kLegForward,
  kLegOut,
  kLegInward,  // around its own axis
  kKnee,
};
inline constexpr int kOneSidedAngles = static_cast<int>(JointAngle::kKnee) + 1;
inline constexpr int kSideAngles = kOneSidedAngles - static_cast<int>(JointAngle::kClavicleRaise);
inline constexpr int kAngles = kOneSidedAngles + kSideAngles;
enum class BodySide : int { kLeft = 0, kRight = 1 };

// Degrees; zero: upright, arms and legs straight down.
struct JointAngles {
  std::array<double, kAngles> deg = {};  // those of the right side come last

  double& Of(JointAngle angle, BodySide side = BodySide::kLeft) { return deg[IndexOf(angle, side)]; }
  double Of(JointAngle angle, BodySide side = BodySide::kLeft) const { return deg[IndexOf(angle, side)]; }
  static constexpr size_t IndexOf(JointAngle angle, BodySide side) {
    return static_cast<size_t>(static_cast<int>(angle) + static_cast<int>(side) * kSideAngles);
  }
};

// What a healthy adult does in clothes without effort; about three quarters of the joints' full range (the
// range: Nordin and Frankel, Basic Biomechanics of the Musculoskeletal System).
struct AngleLimit {
  double low_deg, high_deg;
  double fastest_deg_s;  // of fluent motion
};
AngleLimit LimitOf(size_t index);  // into JointAngles::deg

// Standing at ease: arms a little away from the trunk.
JointAngles NaturalAngles();

// Angles beyond their limits are brought back to them.
JointAngles WithinLimits(JointAngles angles);

FigurePose PoseOf(const JointAngles& angles);

// The smallest kArmOut, in degrees, not below the given one, at which that arm stays `clear_mm` away from an
// average trunk; the limit where there is none. The trunk counts as an elliptical cylinder about the chest's
// axis.
double ClearArmOut(const JointAngles& angles, BodySide side, double clear_mm);

}  // namespace weft
