#include "figure/motion_generator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/nearest_word.h"
#include "base/status_macros.h"
#include "figure/choreography.h"
#include "figure/joint_angles.h"

namespace weft {
namespace {

constexpr std::array<MotionKindInfo, 9> kKinds = {{
    {MotionKind::kStanding, "standing", "stands at ease, breathes and sways"},
    {MotionKind::kTwist, "twist", "turns the trunk to and fro, arms away"},
    {MotionKind::kJogging, "jogging", "jogs on the spot"},
    {MotionKind::kWalk, "walk", "walks on a treadmill"},
    {MotionKind::kWave, "wave", "raises one arm or the other and waves"},
    {MotionKind::kSpline, "spline", "every joint at random within its limits, smoothly"},
    {MotionKind::kMixed, "mixed", "a few seconds of each of the above in turn, at random"},
    {MotionKind::kSquat, "squat", "squats and rises, arms forwards"},
    {MotionKind::kReach, "reach", "reaches up, across and with a hand before the chest"},
}};

constexpr double kArmClearMm = 12;

// At least `values` everywhere, and smooth: the largest nearby, averaged.
std::vector<double> SmoothlyAbove(const std::vector<double>& values, double fps) {
  const int radius = std::max(1, static_cast<int>(std::lround(0.25 * fps)));
  const auto count = static_cast<int>(values.size());
  const auto at = [&](const std::vector<double>& v, int k) {
    return v[static_cast<size_t>(std::clamp(k, 0, count - 1))];
  };
  std::vector<double> largest(values.size()), out(values.size());
  for (int k = 0; k < count; ++k)
    for (int d = -radius; d <= radius; ++d)
      largest[static_cast<size_t>(k)] = std::max(largest[static_cast<size_t>(k)], at(values, k + d));
  for (int k = 0; k < count; ++k) {
    double sum = 0, weights = 0;
    for (int d = -radius; d <= radius; ++d) {
      const double weight = 0.5 + 0.5 * std::cos(std::numbers::pi * d / (radius + 1));
      sum += weight * at(largest, k + d), weights += weight;
    }
    out[static_cast<size_t>(k)] = sum / weights;
  }
  return out;
}

void KeepArmsClear(std::vector<JointAngles>& moments, double fps) {
  for (const BodySide side : {BodySide::kLeft, BodySide::kRight}) {
    std::vector<double> missing(moments.size());
    for (size_t k = 0; k < moments.size(); ++k)
      missing[k] = ClearArmOut(moments[k], side, kArmClearMm) - moments[k].Of(JointAngle::kArmOut, side);
    missing = SmoothlyAbove(missing, fps);
    for (size_t k = 0; k < moments.size(); ++k) moments[k].Of(JointAngle::kArmOut, side) += missing[k];
  }
}

// The lower ankle stays at its height, or above it by up to kSoftMm where both are down; so the change of
// feet is smooth. Both are above their place on average.
void StandOnGround(double lift_mm, FigurePose& pose) {
  constexpr double kSoftMm = 4;
  static const Skeleton skeleton = SkeletonOf(BodyShape());
  const auto world = WorldFromRest(skeleton, pose);
  const Eigen::Vector3d left = world[static_cast<size_t>(Joint::kLeftShin)] * skeleton.left_ankle_mm;
  const Eigen::Vector3d right = world[static_cast<size_t>(Joint::kRightShin)] * skeleton.right_ankle_mm;
  const double apart = 0.5 * (left.y() - right.y());
  const double lowest = 0.5 * (left.y() + right.y()) + std::hypot(apart, kSoftMm);
  pose.root_mm = -0.5 * (left + right);
  pose.root_mm.y() = skeleton.left_ankle_mm.y() - lowest - lift_mm;
}

}  // namespace

std::span<const MotionKindInfo> MotionKinds() { return kKinds; }

std::string_view NameOf(MotionKind kind) { return kKinds[static_cast<size_t>(kind)].name; }

absl::StatusOr<MotionKind> MotionKindNamed(std::string_view name) {
  std::vector<std::string> names;
  for (const MotionKindInfo& info : kKinds) {
    if (info.name == name) return info.kind;
    names.emplace_back(info.name);
  }
  return absl::InvalidArgumentError(absl::StrCat("motion \"", std::string(name), "\" is none of ",
                                                 absl::StrJoin(names, ", "), DidYouMean(name, names)));
}

absl::Status MotionOptions::Validate() const {
  if (!(seconds > 0 && seconds <= 3600))
    return absl::InvalidArgumentError(
        absl::StrCat("motion: seconds is ", seconds, ", expected more than 0, up to 3600"));
  if (!(fps >= 24 && fps <= 240))
    return absl::InvalidArgumentError(absl::StrCat("motion: fps is ", fps, ", expected 24 to 240"));
  return absl::OkStatus();
}

absl::StatusOr<Motion> MakeMotion(const MotionOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const Choreography choreography = MakeChoreography(options.kind, options.seconds, options.seed);
  const auto count = static_cast<size_t>(std::llround(options.seconds * options.fps)) + 1;
  std::vector<JointAngles> angles(count);
  std::vector<double> lift_mm(count);
  for (size_t k = 0; k < count; ++k) {
    const BodyMoment moment = choreography(static_cast<double>(k) / options.fps);
    angles[k] = WithinLimits(moment.angles);
    lift_mm[k] = moment.lift_mm;
  }
  KeepArmsClear(angles, options.fps);
  Motion out;
  out.fps = options.fps;
  for (size_t k = 0; k < count; ++k) {
    out.poses.push_back(PoseOf(WithinLimits(angles[k])));
    StandOnGround(lift_mm[k], out.poses.back());
  }
  return out;
}

}  // namespace weft
