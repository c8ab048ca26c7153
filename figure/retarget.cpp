#include "figure/retarget.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"

namespace weft {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// The axis of the world that is nearest.
Vector3d NearestAxis(const Vector3d& v) {
  Eigen::Index k = 0;
  v.cwiseAbs().maxCoeff(&k);
  return (v[k] < 0 ? -1 : 1) * Vector3d::Unit(k);
}

class Retargeter {
 public:
  Retargeter(const ForeignMotion& from, const JointMatch& match) : from_(from), match_(match) {}

  absl::StatusOr<Motion> Run() {
    PlaceAtRest();
    if (absl::Status status = FindAxes(); !status.ok()) return status;
    FindLimbs();
    Motion out;
    out.fps = from_.fps;
    for (const ForeignMotion::Pose& pose : from_.poses) out.poses.push_back(PoseFrom(pose));
    if (absl::Status status = out.Validate(); !status.ok()) return status;
    PlaceOnGround(out);
    if (absl::Status status = out.Validate(); !status.ok()) return status;
    return out;
  }

 private:
  int Of(Joint joint) const { return match_.of[static_cast<size_t>(joint)]; }
  const Vector3d& AtRest(Joint joint) const { return rest_[static_cast<size_t>(Of(joint))]; }

  void PlaceAtRest() {
    for (const ForeignMotion::Joint& joint : from_.joints)
      rest_.push_back(joint.parent < 0 ? Vector3d(0, 0, 0)
                                       : Vector3d(rest_[static_cast<size_t>(joint.parent)] + joint.offset));
  }

  // The rotation from the file's world to ours (x right, y down, a person looks towards -z), and the scale.
  absl::Status FindAxes() {
    const Vector3d hips = 0.5 * (AtRest(Joint::kLeftThigh) + AtRest(Joint::kRightThigh));
    const Vector3d knees = 0.5 * (AtRest(Joint::kLeftShin) + AtRest(Joint::kRightShin));
    const Vector3d up = NearestAxis(hips - knees);
    const Vector3d side = NearestAxis(AtRest(Joint::kRightThigh) - AtRest(Joint::kLeftThigh));
    const double shins = ShinLength(0) + ShinLength(1);
    const double legs = (AtRest(Joint::kLeftThigh) - AtRest(Joint::kLeftShin)).norm() +
                        (AtRest(Joint::kRightThigh) - AtRest(Joint::kRightShin)).norm();
    if (!(legs + shins > 0) || !std::isfinite(legs + shins))
      return absl::InvalidArgumentError("the legs have no length at rest; are the offsets missing?");
    if (std::abs(up.dot(side)) > 0.5)
      return absl::InvalidArgumentError(
          "the rest pose does not stand upright with legs side by side, which tells up from sideways");
    const Skeleton skeleton = SkeletonOf(BodyShape());
    const double ours = (skeleton.At(Joint::kLeftThigh) - skeleton.At(Joint::kLeftShin)).norm() +
                        (shins > 0 ? (skeleton.At(Joint::kLeftShin) - skeleton.left_ankle_mm).norm() : 0);
    scale_ = 2 * ours / (legs + shins);
    Matrix3d axes;
    axes.row(0) = side;
    axes.row(1) = -up;
    axes.row(2) = side.cross(-up);
    ours_from_theirs_ = Quaterniond(axes);
    return absl::OkStatus();
  }

  double ShinLength(size_t side) const {
    const int ankle = match_.ankles[side];
    if (ankle < 0) return 0;
    return (rest_[static_cast<size_t>(ankle)] - AtRest(side == 0 ? Joint::kLeftShin : Joint::kRightShin))
        .norm();
  }

  // The joint at which a limb's bone ends: the next joint of ours, else the first that hangs on it.
  int EndOf(size_t joint) const {
    for (size_t next = joint + 1; next < kJoints; ++next)
      if (ParentOf(static_cast<Joint>(next)) == static_cast<Joint>(joint) && match_.of[next] >= 0)
        return match_.of[next];
    if (joint == static_cast<size_t>(Joint::kLeftShin) && match_.ankles[0] >= 0) return match_.ankles[0];
    if (joint == static_cast<size_t>(Joint::kRightShin) && match_.ankles[1] >= 0) return match_.ankles[1];
    for (size_t k = 0; k < from_.joints.size(); ++k)
      if (from_.joints[k].parent == match_.of[joint]) return static_cast<int>(k);
    return -1;
  }

  // Where limbs hang down in our rest pose, they point elsewhere in the file's: a T pose, for example.
  void FindLimbs() {
    limb_.fill(Quaterniond::Identity());
    for (const Joint first :
         {Joint::kLeftUpperArm, Joint::kRightUpperArm, Joint::kLeftThigh, Joint::kRightThigh}) {
      const bool is_arm = first == Joint::kLeftUpperArm || first == Joint::kRightUpperArm;
      Quaterniond before = Quaterniond::Identity();
      for (size_t j = static_cast<size_t>(first); j < static_cast<size_t>(first) + (is_arm ? 3 : 2); ++j) {
        limb_[j] = before;  // straight on where the file does not tell
        if (match_.of[j] < 0) continue;
        const int end = EndOf(j);
        if (end < 0) continue;
        const Vector3d bone =
            ours_from_theirs_ * (rest_[static_cast<size_t>(end)] - rest_[static_cast<size_t>(match_.of[j])]);
        // One further arc from where the bone before it points, so that a straight limb is not twisted.
        if (bone.norm() > 0)
          limb_[j] = Quaterniond::FromTwoVectors(before * Vector3d::UnitY(), bone) * before;
        before = limb_[j];
      }
    }
  }

  FigurePose PoseFrom(const ForeignMotion::Pose& pose) const {
    std::vector<Quaterniond> world;
    for (size_t k = 0; k < from_.joints.size(); ++k) {
      const int parent = from_.joints[k].parent;
      world.push_back(parent < 0 ? pose.rotation[k]
                                 : (world[static_cast<size_t>(parent)] * pose.rotation[k]).normalized());
    }
    std::array<Quaterniond, kJoints> ours;
    for (size_t j = 0; j < kJoints; ++j) {
      const auto parent = static_cast<size_t>(ParentOf(static_cast<Joint>(j)));
      if (match_.of[j] >= 0)
        ours[j] = ours_from_theirs_ * world[static_cast<size_t>(match_.of[j])] *
                  ours_from_theirs_.conjugate() * limb_[j];
      else
        ours[j] = ours[parent] * limb_[parent].conjugate() * limb_[j];
    }
    // A trunk of one joint bends half way at the spine.
    if (Of(Joint::kSpine) < 0)
      ours[static_cast<size_t>(Joint::kSpine)] = ours[0].slerp(0.5, ours[static_cast<size_t>(Joint::kChest)]);
    FigurePose out;
    out.root_mm = scale_ * (ours_from_theirs_ * pose.root);
    for (size_t j = 0; j < kJoints; ++j) {
      const auto parent = static_cast<size_t>(ParentOf(static_cast<Joint>(j)));
      out.rotation[j] = (j == 0 ? ours[0] : ours[parent].conjugate() * ours[j]).normalized();
    }
    return out;
  }

  // Looks to the front at first, and the lower foot is on the ground at all but the lowest moments.
  static void PlaceOnGround(Motion& motion) {
    const Vector3d ahead = motion.poses.front().Of(Joint::kPelvis) * -Vector3d::UnitZ();
    const double heading = std::atan2(ahead.x(), -ahead.z());
    const Quaterniond turn(Eigen::AngleAxisd(heading, Vector3d::UnitY()));
    const Vector3d from = motion.poses.front().root_mm;
    const Skeleton skeleton = SkeletonOf(BodyShape());
    std::vector<double> lower;
    for (FigurePose& pose : motion.poses) {
      pose.root_mm = turn * Vector3d(pose.root_mm - from);
      pose.Of(Joint::kPelvis) = (turn * pose.Of(Joint::kPelvis)).normalized();
      const auto world = WorldFromRest(skeleton, pose);
      lower.push_back(
          std::max((world[static_cast<size_t>(Joint::kLeftShin)] * skeleton.left_ankle_mm).y(),
                   (world[static_cast<size_t>(Joint::kRightShin)] * skeleton.right_ankle_mm).y()));
    }
    constexpr double kRank = 0.95;
    const auto rank = static_cast<size_t>(kRank * static_cast<double>(lower.size() - 1));
    const double sink = skeleton.left_ankle_mm.y() - ValueAtRank(lower, rank);
    for (FigurePose& pose : motion.poses) pose.root_mm.y() += sink;
  }

  const ForeignMotion& from_;
  const JointMatch& match_;
  std::vector<Vector3d> rest_;
  double scale_ = 1;
  Quaterniond ours_from_theirs_ = Quaterniond::Identity();
  std::array<Quaterniond, kJoints> limb_;  // from our rest pose to the file's
};

}  // namespace

absl::StatusOr<Motion> Retarget(const ForeignMotion& motion, const JointMatch& match) {
  return Retargeter(motion, match).Run();
}

}  // namespace weft
