#include "figure/joint_angles.h"

#include <algorithm>
#include <cmath>

#include "base/angles.h"

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

using enum JointAngle;

constexpr std::array<AngleLimit, kOneSidedAngles> kLimits = {{
    {-180, 180, 90},  // pelvis turn
    {-15, 40, 60},    // tilt
    {-15, 15, 50},    // list
    {-10, 30, 60},    // spine lean
    {-15, 15, 60},    // side
    {-18, 18, 90},    // twist
    {-10, 25, 60},    // chest lean
    {-12, 12, 60},    // side
    {-25, 25, 120},   // twist
    {-30, 35, 120},   // head nod
    {-25, 25, 90},    // side
    {-55, 55, 180},   // turn
    {-4, 25, 60},     // clavicle raise
    {-12, 22, 60},    // forward
    {-35, 140, 240},  // arm forward
    {4, 125, 240},    // out
    {-45, 60, 180},   // inward
    {2, 130, 300},    // elbow
    {-70, 70, 240},   // forearm turn
    {-45, 45, 240},   // wrist
    {-20, 105, 240},  // leg forward
    {-6, 40, 120},    // out
    {-25, 25, 120},   // inward
    {0, 125, 300},    // knee
}};

Quaterniond About(double degrees, const Vector3d& axis) {
  return Quaterniond(AngleAxisd(kRadPerDeg * degrees, axis));
}

void SetSide(const JointAngles& a, BodySide side, FigurePose& pose) {
  const double sign = side == BodySide::kLeft ? -1 : 1;
  const Joint clavicle = side == BodySide::kLeft ? Joint::kLeftClavicle : Joint::kRightClavicle;
  const Joint thigh = side == BodySide::kLeft ? Joint::kLeftThigh : Joint::kRightThigh;
  const auto after = [](Joint joint, int k) { return static_cast<Joint>(static_cast<int>(joint) + k); };
  const auto x = [&](JointAngle angle) { return a.Of(angle, side); };
  const Vector3d right = Vector3d::UnitX(), down = Vector3d::UnitY(), back = Vector3d::UnitZ();
  pose.Of(clavicle) = About(-sign * x(kClavicleRaise), back) * About(sign * x(kClavicleForward), down);
  pose.Of(after(clavicle, 1)) =
      About(-x(kArmForward), right) * About(-sign * x(kArmOut), back) * About(sign * x(kArmInward), down);
  pose.Of(after(clavicle, 2)) = About(-x(kElbow), right);
  pose.Of(after(clavicle, 3)) = About(sign * x(kForearmTurn), down) * About(-x(kWrist), right);
  pose.Of(thigh) =
      About(-x(kLegForward), right) * About(-sign * x(kLegOut), back) * About(sign * x(kLegInward), down);
  pose.Of(after(thigh, 1)) = About(x(kKnee), right);
}

// How far the arm is from the trunk, and how much of that is missing to `clear_mm`; 0 or less: it is clear.
double ArmOverlapMm(const JointAngles& angles, BodySide side, double clear_mm) {
  constexpr double kHalfWidthMm = 172, kHalfDepthMm = 118, kFromMm = -220, kToMm = 230;
  static const Skeleton skeleton = SkeletonOf(BodyShape());
  const auto world = WorldFromRest(skeleton, PoseOf(angles));
  const int clavicle =
      static_cast<int>(side == BodySide::kLeft ? Joint::kLeftClavicle : Joint::kRightClavicle);
  const Eigen::Isometry3d chest_from_world = world[static_cast<size_t>(Joint::kChest)].inverse();
  const Vector3d elbow = skeleton.rest_mm[static_cast<size_t>(clavicle + 2)];
  const Vector3d wrist = skeleton.rest_mm[static_cast<size_t>(clavicle + 3)];
  struct Point {
    int joint;
    Vector3d rest_mm;
    double radius_mm;
  };
  const std::array<Point, 4> points = {{{clavicle + 1, elbow, 43},
                                        {clavicle + 2, 0.5 * (elbow + wrist), 36},
                                        {clavicle + 3, wrist, 33},
                                        {clavicle + 3, wrist + Vector3d(0, 90, 0), 33}}};
  double worst = -1e9;
  for (const Point& p : points) {
    const Vector3d at = chest_from_world * world[static_cast<size_t>(p.joint)] * p.rest_mm;
    const double beyond = std::max({0.0, kFromMm - at.y(), at.y() - kToMm});
    const double reach = p.radius_mm + clear_mm;
    const double width = kHalfWidthMm + reach, depth = kHalfDepthMm + reach;
    const double radius = std::hypot(at.x() / width, at.z() / depth);
    worst = std::max(worst, (1 - radius) * std::min(width, depth) - beyond);
  }
  return worst;
}

}  // namespace

AngleLimit LimitOf(size_t index) { return kLimits[index < kOneSidedAngles ? index : index - kSideAngles]; }

JointAngles NaturalAngles() {
  JointAngles out;
  for (const BodySide side : {BodySide::kLeft, BodySide::kRight})
    out.Of(kArmOut, side) = 38, out.Of(kElbow, side) = 12;
  return out;
}

JointAngles WithinLimits(JointAngles angles) {
  for (size_t k = 0; k < kAngles; ++k)
    angles.deg[k] = std::clamp(angles.deg[k], LimitOf(k).low_deg, LimitOf(k).high_deg);
  return angles;
}

FigurePose PoseOf(const JointAngles& a) {
  FigurePose pose;
  const Vector3d right = Vector3d::UnitX(), down = Vector3d::UnitY(), back = Vector3d::UnitZ();
  const auto bend = [&](JointAngle lean, JointAngle side, JointAngle twist) {
    return About(a.Of(twist), down) * About(a.Of(lean), right) * About(a.Of(side), back);
  };
  pose.Of(Joint::kPelvis) = bend(kPelvisTilt, kPelvisList, kPelvisTurn);
  pose.Of(Joint::kSpine) = bend(kSpineLean, kSpineSide, kSpineTwist);
  pose.Of(Joint::kChest) = bend(kChestLean, kChestSide, kChestTwist);
  pose.Of(Joint::kHead) = bend(kHeadNod, kHeadSide, kHeadTurn);
  SetSide(a, BodySide::kLeft, pose);
  SetSide(a, BodySide::kRight, pose);
  return pose;
}

double ClearArmOut(const JointAngles& angles, BodySide side, double clear_mm) {
  const double from = angles.Of(kArmOut, side);
  const double most = LimitOf(JointAngles::IndexOf(kArmOut, side)).high_deg;
  constexpr double kStepDeg = 1;
  JointAngles trial = angles;
  double before = ArmOverlapMm(trial, side, clear_mm);
  if (before <= 0) return from;
  for (double degrees = from + kStepDeg; degrees < most; degrees += kStepDeg) {
    trial.Of(kArmOut, side) = degrees;
    const double overlap = ArmOverlapMm(trial, side, clear_mm);
    // Linear in between, so that the answer moves smoothly with the pose.
    if (overlap <= 0) return degrees - kStepDeg * overlap / (overlap - before);
    before = overlap;
  }
  return most;
}

}  // namespace weft
