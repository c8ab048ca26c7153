#include "services/formats/figure/motion_strip.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/angles.h"

namespace weft {
namespace {

constexpr int kMoments = 12;
constexpr double kScale = 0.09;  // pixels a mm
constexpr double kWide = 130, kTall = 200;

// The bones of a figure, in mm in the world; the last part of each limb has no joint at its end.
std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> BonesOf(const Skeleton& skeleton,
                                                                 const FigurePose& pose) {
  const auto world = WorldFromRest(skeleton, pose);
  const auto at = [&](Joint joint) -> Eigen::Vector3d {
    return world[static_cast<size_t>(joint)] * skeleton.At(joint);
  };
  const auto end = [&](Joint joint, const Eigen::Vector3d& rest) -> Eigen::Vector3d {
    return world[static_cast<size_t>(joint)] * rest;
  };
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> out;
  for (int j = 1; j < kJoints; ++j) {
    const auto joint = static_cast<Joint>(j);
    out.emplace_back(at(ParentOf(joint)), at(joint));
  }
  out.emplace_back(at(Joint::kHead),
                   end(Joint::kHead, skeleton.At(Joint::kHead) + Eigen::Vector3d(0, -190, -15)));
  for (const Joint hand : {Joint::kLeftHand, Joint::kRightHand})
    out.emplace_back(at(hand), end(hand, skeleton.At(hand) + Eigen::Vector3d(0, 90, 0)));
  out.emplace_back(at(Joint::kLeftShin), end(Joint::kLeftShin, skeleton.left_ankle_mm));
  out.emplace_back(at(Joint::kRightShin), end(Joint::kRightShin, skeleton.right_ankle_mm));
  return out;
}

}  // namespace

std::array<JointUse, kJoints> JointUses(const Motion& motion) {
  std::array<JointUse, kJoints> out;
  for (size_t j = 0; j < kJoints; ++j) {
    out[j].joint = static_cast<Joint>(j);
    for (size_t k = 0; k < motion.poses.size(); ++k) {
      const Eigen::Quaterniond& q = motion.poses[k].rotation[j];
      const double from_rest = q.angularDistance(Eigen::Quaterniond::Identity()) / kRadPerDeg;
      out[j].farthest_deg = std::max(out[j].farthest_deg, from_rest);
      if (k == 0) continue;
      const double turned = q.angularDistance(motion.poses[k - 1].rotation[j]) / kRadPerDeg;
      out[j].fastest_deg_s = std::max(out[j].fastest_deg_s, turned * motion.fps);
    }
  }
  return out;
}

std::string MotionStripSvg(const Motion& motion) {
  const Skeleton skeleton = SkeletonOf(BodyShape());
  std::string out = absl::StrFormat(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %g %g\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
      kWide * kMoments, 2 * kTall + 40);
  for (int m = 0; m < kMoments; ++m) {
    const double time_s = motion.DurationS() * m / (kMoments - 1);
    const auto bones = BonesOf(skeleton, motion.PoseAt(time_s));
    const double middle = kWide * (m + 0.5);
    absl::StrAppendFormat(&out, "<text x=\"%g\" y=\"%g\" text-anchor=\"middle\">%.2f s</text>\n", middle,
                          2 * kTall + 30, time_s);
    for (const bool side : {false, true})
      for (const auto& [a, b] : bones) {
        // As cameras see it: from the front x is to the right; from the person's left it looks to the left.
        const auto x = [&](const Eigen::Vector3d& p) { return middle + kScale * (side ? p.z() : p.x()); };
        const auto y = [&](const Eigen::Vector3d& p) { return (side ? kTall : 0) + 85 + kScale * p.y(); };
        absl::StrAppendFormat(
            &out,
            "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#224\" stroke-width=\"5\" "
            "stroke-linecap=\"round\"/>\n",
            x(a), y(a), x(b), y(b));
      }
  }
  return out + "</svg>\n";
}

}  // namespace weft
