// Motions as joint angles over time; motion_generator.h makes poses of them.
#pragma once

#include <cstdint>
#include <functional>

#include "figure/joint_angles.h"
#include "figure/motion_generator.h"

namespace weft {

struct BodyMoment {
  JointAngles angles = NaturalAngles();
  double lift_mm = 0;  // of the lower foot above the ground
};

using Choreography = std::function<BodyMoment(double time_s)>;

// Smooth in time up to `seconds`. Angles may be beyond their limits, arms may pass through the trunk.
Choreography MakeChoreography(MotionKind kind, double seconds, uint64_t seed);

}  // namespace weft
