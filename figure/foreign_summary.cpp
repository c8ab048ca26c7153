#include "figure/foreign_summary.h"

#include <Eigen/Geometry>

namespace weft {
namespace {

using Eigen::Vector3d;

// The next joint of ours, else the joints that hang on it: the fingers of a hand.
std::vector<int> EndsOf(const ForeignMotion& motion, const JointMatch& match, size_t joint) {
  if (match.of[joint] < 0) return {};
  for (size_t next = joint + 1; next < kJoints; ++next)
    if (ParentOf(static_cast<Joint>(next)) == static_cast<Joint>(joint) && match.of[next] >= 0)
      return {match.of[next]};
  if (joint == static_cast<size_t>(Joint::kLeftShin) && match.ankles[0] >= 0) return {match.ankles[0]};
  if (joint == static_cast<size_t>(Joint::kRightShin) && match.ankles[1] >= 0) return {match.ankles[1]};
  std::vector<int> out;
  for (size_t k = 0; k < motion.joints.size(); ++k)
    if (motion.joints[k].parent == match.of[joint]) out.push_back(static_cast<int>(k));
  // Eyes and a jaw do not tell where a head ends.
  if (!IsLimb(static_cast<Joint>(joint)) && out.size() > 1) out.clear();
  return out;
}

class Summary {
 public:
  Summary(const ForeignMotion& motion, const JointMatch& match) : match_(match) {
    for (size_t j = 0; j < kJoints; ++j) {
      out_.ends[j] = EndsOf(motion, match, j);
      out_.bone[j].setZero();
      out_.hinge[j].setZero();
      out_.bend[j] = 0;
      out_.turn[j].setZero();
    }
    for (Vector3d* v : {&out_.hips, &out_.trunk, &out_.shoulders, &out_.body}) v->setZero();
    const double count = static_cast<double>(motion.poses.size());
    for (const ForeignMotion::Pose& pose : motion.poses) Add(PostureOf(motion, pose), 1 / count);
  }

  ForeignSummary&& Take() { return std::move(out_); }

 private:
  int Of(Joint joint) const { return match_.of[static_cast<size_t>(joint)]; }

  void Add(const ForeignPosture& posture, double share) {
    const auto at = [&](int joint) -> const Vector3d& { return posture.at[static_cast<size_t>(joint)]; };
    const auto in_axes_of = [&](int joint, const Vector3d& v) -> Vector3d {
      return posture.rotation[static_cast<size_t>(joint)].conjugate() * v;
    };
    AddJoints(posture, share);
    const Vector3d left = at(Of(Joint::kLeftThigh)), right = at(Of(Joint::kRightThigh));
    const Vector3d hips = 0.5 * (left + right);
    const int pelvis = Of(Joint::kPelvis), chest = Of(Joint::kChest);
    out_.hips += share * in_axes_of(pelvis, right - left);
    const Vector3d shoulders = 0.5 * (at(Of(Joint::kLeftUpperArm)) + at(Of(Joint::kRightUpperArm)));
    const int spine = Of(Joint::kSpine);
    const double leg = AddLegs(posture, share);
    // A spine that begins between the hips does not tell where upwards is.
    Vector3d trunk = (spine >= 0 ? at(spine) : at(chest)) - hips;
    constexpr double kLeastTrunk = 0.05;
    if (trunk.norm() < kLeastTrunk * leg) trunk = at(chest) - hips;
    if (trunk.norm() < kLeastTrunk * leg) trunk = shoulders - hips;
    out_.trunk += share * in_axes_of(pelvis, trunk);
    if (chest >= 0)
      out_.shoulders +=
          share * in_axes_of(chest, at(Of(Joint::kRightUpperArm)) - at(Of(Joint::kLeftUpperArm)));
    const Vector3d feet = 0.5 * (Foot(posture, 0) + Foot(posture, 1));
    const Vector3d body = (shoulders - feet).normalized();
    out_.body += share * body;
    out_.hips_along_body += share * std::abs((right - left).normalized().dot(body));
  }

  void AddJoints(const ForeignPosture& posture, double share) {
    for (size_t j = 0; j < kJoints; ++j) {
      if (match_.of[j] < 0) continue;
      const auto me = static_cast<size_t>(match_.of[j]);
      if (const int parent = MatchedParent(match_, j); parent >= 0) {
        const auto above = static_cast<size_t>(match_.of[static_cast<size_t>(parent)]);
        out_.turn[j] +=
            share * (posture.rotation[above].conjugate() * posture.rotation[me]).toRotationMatrix();
      }
      if (out_.ends[j].empty()) continue;
      const Vector3d bone = EndIn(posture, out_.ends[j]) - posture.at[me];
      out_.bone[j] += share * (posture.rotation[me].conjugate() * bone);
      AddHinge(posture, j, bone, share);
    }
  }

  void AddHinge(const ForeignPosture& posture, size_t j, const Vector3d& bone, double share) {
    const auto joint = static_cast<Joint>(j);
    if (joint != Joint::kLeftUpperArm && joint != Joint::kRightUpperArm && joint != Joint::kLeftThigh &&
        joint != Joint::kRightThigh)
      return;
    if (match_.of[j + 1] < 0 || out_.ends[j + 1].empty()) return;
    const Vector3d next = EndIn(posture, out_.ends[j + 1]) - EndIn(posture, out_.ends[j]);
    const Vector3d axis = bone.normalized().cross(next.normalized());
    out_.hinge[j] += share * (posture.rotation[static_cast<size_t>(match_.of[j])].conjugate() * axis);
    out_.bend[j] += share * axis.norm();
  }

  // The mean length of both legs in this posture.
  double AddLegs(const ForeignPosture& posture, double share) {
    double length = 0;
    for (const size_t side : {size_t{0}, size_t{1}}) {
      const auto at = [&](Joint joint) { return posture.at[static_cast<size_t>(Of(joint))]; };
      const Vector3d knee = at(side == 0 ? Joint::kLeftShin : Joint::kRightShin);
      length += 0.5 * (at(side == 0 ? Joint::kLeftThigh : Joint::kRightThigh) - knee).norm();
      // Both ankles or none: one scale for both legs.
      if (match_.ankles[0] >= 0 && match_.ankles[1] >= 0) length += 0.5 * (Foot(posture, side) - knee).norm();
    }
    out_.leg_length += share * length;
    return length;
  }

  Vector3d Foot(const ForeignPosture& posture, size_t side) const {
    const int ankle = match_.ankles[side];
    return posture.at[static_cast<size_t>(ankle >= 0  ? ankle
                                          : side == 0 ? Of(Joint::kLeftShin)
                                                      : Of(Joint::kRightShin))];
  }

  const JointMatch& match_;
  ForeignSummary out_;
};

}  // namespace

ForeignPosture PostureOf(const ForeignMotion& motion, const ForeignMotion::Pose& pose) {
  ForeignPosture out;
  out.at.reserve(motion.joints.size());
  out.rotation.reserve(motion.joints.size());
  for (size_t k = 0; k < motion.joints.size(); ++k) {
    const ForeignMotion::Joint& joint = motion.joints[k];
    const Vector3d& offset = joint.place < 0 ? joint.offset : pose.place[static_cast<size_t>(joint.place)];
    if (joint.parent < 0) {
      out.at.push_back(offset);
      out.rotation.push_back(pose.rotation[k]);
      continue;
    }
    const auto parent = static_cast<size_t>(joint.parent);
    out.at.push_back(out.at[parent] + out.rotation[parent] * offset);
    out.rotation.push_back((out.rotation[parent] * pose.rotation[k]).normalized());
  }
  return out;
}

bool IsLimb(Joint joint) {
  switch (joint) {
    case Joint::kPelvis:
    case Joint::kSpine:
    case Joint::kChest:
    case Joint::kHead:
    case Joint::kLeftClavicle:
    case Joint::kRightClavicle:
      return false;
    default:
      return true;
  }
}

int MatchedParent(const JointMatch& match, size_t joint) {
  while (joint != 0) {
    joint = static_cast<size_t>(ParentOf(static_cast<Joint>(joint)));
    if (match.of[joint] >= 0) return static_cast<int>(joint);
  }
  return -1;
}

Vector3d EndIn(const ForeignPosture& posture, const std::vector<int>& ends) {
  Vector3d sum = Vector3d::Zero();
  for (const int end : ends) sum += posture.at[static_cast<size_t>(end)];
  return sum / static_cast<double>(ends.size());
}

ForeignSummary Summarize(const ForeignMotion& motion, const JointMatch& match) {
  return Summary(motion, match).Take();
}

}  // namespace weft
