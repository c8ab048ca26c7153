#include "simulation/body_motion.h"

#include <algorithm>
#include <cmath>

#include "base/angles.h"
#include "simulation/random.h"
#include "simulation/wardrobe.h"

namespace weft {
namespace {

// Of kTwistAndPinch: the trunk calms down, and is calm when the hand comes near.
constexpr double kCalmFromS = 2.3, kHandFromS = 3.2;

// What the seed decides: `k` numbers one use.
struct Whims {
  uint64_t key;
  double Phase(uint64_t k) const { return kTurn * UniformOf(key, 2 * k); }
  double Size(uint64_t k) const { return 0.9 + 0.2 * UniformOf(key, 2 * k + 1); }
};

// Nobody stands quite still.
void Breathe(double t, const Whims& whims, BodyPose& pose) {
  pose.breath_mm += 2.5 * whims.Size(0) * (1 - std::cos(kTurn * t / 3.4));
  pose.twist += 2.5 * kRadPerDeg * std::sin(kTurn * t / 4.7 + whims.Phase(1));
  pose.lean += 1.2 * kRadPerDeg * std::sin(kTurn * t / 3.9 + whims.Phase(2));
  pose.left.arm_out += 2.5 * kRadPerDeg * std::sin(kTurn * t / 4.1 + whims.Phase(3));
  pose.right.arm_out += 2.5 * kRadPerDeg * std::sin(kTurn * t / 4.4 + whims.Phase(4));
  pose.root_mm.x() += 4 * std::sin(kTurn * t / 5.3 + whims.Phase(5));
}

void Twist(double t, const Whims& whims, BodyPose& pose) {
  const double swing = std::sin(kTurn * t / 2.6);
  pose.twist += 32 * kRadPerDeg * whims.Size(1) * swing;
  pose.turn += 5 * kRadPerDeg * swing;
  pose.left.arm_out += 14 * kRadPerDeg, pose.right.arm_out += 14 * kRadPerDeg;
  pose.left.arm_forward += 10 * kRadPerDeg * swing, pose.right.arm_forward -= 10 * kRadPerDeg * swing;
  pose.lean += 4 * kRadPerDeg * std::sin(kTurn * t / 3.7 + whims.Phase(2));
}

void Jog(double t, const Whims& whims, BodyPose& pose) {
  const double stride = kTurn * t * 1.25, swing = std::sin(stride);
  pose.root_mm.y() -= 24 * whims.Size(0) * std::abs(std::cos(stride)) - 12;
  pose.root_mm.x() += 6 * swing;
  pose.lean += 6 * kRadPerDeg;
  pose.twist += 9 * kRadPerDeg * whims.Size(1) * swing;
  pose.turn -= 4 * kRadPerDeg * swing;
  const auto limbs = [&](BodyPose::Limbs& l, double sign) {
    l.arm_out = 33 * kRadPerDeg;
    l.arm_forward = sign * 32 * kRadPerDeg * whims.Size(2) * swing;
    l.elbow = 80 * kRadPerDeg + sign * 8 * kRadPerDeg * swing;
    l.leg_forward = 8 * kRadPerDeg - sign * 32 * kRadPerDeg * swing;
    l.knee = (35 + 30 * sign * std::cos(stride)) * kRadPerDeg;
  };
  limbs(pose.left, 1);
  limbs(pose.right, -1);
}

}  // namespace

std::string_view NameOf(PerformanceMotion motion) {
  switch (motion) {
    case PerformanceMotion::kBreathing:
      return "breathing";
    case PerformanceMotion::kTwist:
      return "twist";
    case PerformanceMotion::kJogging:
      return "jogging";
    case PerformanceMotion::kPinch:
      return "pinch";
    case PerformanceMotion::kTwistAndPinch:
      return "twist-and-pinch";
  }
  return "";
}

double SmoothStep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

BodyPose PoseAt(PerformanceMotion motion, double time_s, uint64_t seed) {
  const BodyPose natural = NaturalPose();
  if (time_s <= 0) return natural;
  const Whims whims = {KeyOf(seed, "choreography")};
  BodyPose pose = natural;
  if (motion == PerformanceMotion::kTwist) Twist(time_s, whims, pose);
  if (motion == PerformanceMotion::kTwistAndPinch) {
    Twist(time_s, whims, pose);
    pose = Mix(pose, natural, SmoothStep((time_s - kCalmFromS) / (kHandFromS - kCalmFromS)));
  }
  if (motion == PerformanceMotion::kJogging) Jog(time_s, whims, pose);
  if (motion != PerformanceMotion::kJogging) Breathe(time_s, whims, pose);
  return Mix(natural, pose, SmoothStep(time_s / 0.6));
}

bool HasHand(PerformanceMotion motion) {
  return motion == PerformanceMotion::kPinch || motion == PerformanceMotion::kTwistAndPinch;
}

PinchState PinchAt(PerformanceMotion motion, double time_s, const Eigen::Vector3d& rest_mm, uint64_t seed) {
  // Of each round: come near, close, pull, hold and wiggle, give back, open and leave. Before the first the
  // hand comes from afar.
  constexpr double kRound = 3.2, kNear = 0.5, kClosed = 0.8, kPulled = 1.4, kBack = 2.2, kOpen = 2.6;
  constexpr double kNearMm = 160, kAfarMm = 600, kClosedMm = 5, kOpenMm = 28;
  const Whims whims = {KeyOf(seed, "pinch")};
  if (motion == PerformanceMotion::kTwistAndPinch) time_s -= kHandFromS;
  const double t = time_s < 0 ? 0 : time_s - kRound * std::floor(time_s / kRound);
  const double arrived = SmoothStep(t / kNear) - SmoothStep((t - kOpen) / (kRound - kOpen));
  const double closed =
      SmoothStep((t - kNear) / (kClosed - kNear)) - SmoothStep((t - kBack) / (kOpen - kBack));
  const double pulled = SmoothStep((t - kClosed) / (kPulled - kClosed)) -
                        SmoothStep((t - 0.85 * kBack) / (kBack - 0.85 * kBack));
  const double away_mm = kNearMm * (1 - arrived) + (kAfarMm - kNearMm) * SmoothStep(-time_s);
  PinchState out;
  out.hand.away = Eigen::Vector3d(0.35, 0.25, -1).normalized();
  const Eigen::Vector3d side(1, 0, 0.35);
  out.hand.grip_mm = rest_mm + (away_mm + 55 * whims.Size(0) * pulled) * out.hand.away +
                     18 * pulled * std::sin(kTurn * t / 0.8 + whims.Phase(1)) * side;
  out.hand.opening_mm = kOpenMm + closed * (kClosedMm - kOpenMm);
  out.is_away = time_s <= -1;
  out.aims = t < 0.8 * kNear;
  out.holds = t >= kNear && t < kBack;
  return out;
}

}  // namespace weft
