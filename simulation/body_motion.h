// What a body does over time.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "figure/body.h"
#include "figure/hand.h"

namespace weft {

// What the person in the garment does.
enum class PerformanceMotion { kBreathing, kTwist, kJogging, kPinch, kTwistAndPinch };

// "breathing", "twist", "jogging", "pinch", "twist-and-pinch".
std::string_view NameOf(PerformanceMotion motion);

// Smooth, from 0 at t <= 0 to 1 at t >= 1.
double SmoothStep(double t);

// The pose at `time_s`; at 0 and before it is the natural one, the motion sets in within 0.6 s. The seed
// decides about phases and small differences of size.
BodyPose PoseAt(PerformanceMotion motion, double time_s, uint64_t seed);

// Motions with a hand in them.
bool HasHand(PerformanceMotion motion);

// The hand at a time. It repeatedly approaches `rest_mm` on the garment, grips, pulls and releases. With
// kTwistAndPinch it stays away while the trunk twists.
struct PinchState {
  HandPose hand;
  bool is_away = false;  // and has not set out yet
  bool aims = false;     // at a place that may still move
  bool holds = false;
};
PinchState PinchAt(PerformanceMotion motion, double time_s, const Eigen::Vector3d& rest_mm, uint64_t seed);

}  // namespace weft
