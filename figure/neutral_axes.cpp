#include "figure/neutral_axes.h"

#include <Eigen/SVD>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Matrix3d CrossWith(const Vector3d& v) {
  Matrix3d out;
  out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return out;
}

// Our x exactly on `x`, our y as near to `y` as that allows; nothing where the two are parallel or zero.
std::optional<Quaterniond> FrameOf(const Vector3d& x, const Vector3d& y) {
  const Vector3d z = x.cross(y);
  if (!(z.norm() > 1e-3 * x.norm() * y.norm()) || !(z.norm() > 0)) return std::nullopt;
  Matrix3d out;
  out.col(0) = x.normalized();
  out.col(2) = z.normalized();
  out.col(1) = out.col(2).cross(out.col(0));
  return Quaterniond(out);
}

class Neutral {
 public:
  Neutral(const JointMatch& match, const ForeignSummary& summary, const std::optional<Matrix3d>& standing)
      : match_(match), summary_(summary), standing_(standing) {
    axes_.fill(Quaterniond::Identity());
    rest_tells_.fill(standing.has_value());
    for (size_t j = 0; j < kJoints; ++j)
      if (match_.of[j] >= 0) axes_[j] = AxesOf(j);
  }

  const std::array<Quaterniond, kJoints>& Get() const { return axes_; }

 private:
  static bool HasHinge(Joint joint) {
    return joint == Joint::kLeftUpperArm || joint == Joint::kRightUpperArm || joint == Joint::kLeftThigh ||
           joint == Joint::kRightThigh;
  }
  // Bones of the trunk go up, bones of limbs down.
  static bool IsTrunk(Joint joint) {
    return joint == Joint::kSpine || joint == Joint::kChest || joint == Joint::kHead;
  }
  static bool IsClavicle(Joint joint) {
    return joint == Joint::kLeftClavicle || joint == Joint::kRightClavicle;
  }

  Quaterniond AxesOf(size_t j) {
    const auto joint = static_cast<Joint>(j);
    const int parent = MatchedParent(match_, j);
    const bool is_limb = IsLimb(joint);
    if (is_limb && !HasHinge(joint) && parent >= 0) rest_tells_[j] = rest_tells_[static_cast<size_t>(parent)];
    if (rest_tells_[j]) {
      const Quaterniond at_rest = Quaterniond(standing_->transpose());
      if (!is_limb) return at_rest;
      const Quaterniond axes = OnRestPose(j, at_rest);
      if (!HingeDenies(j, axes)) return axes;
      rest_tells_[j] = false;
    }
    return FromPoses(j, parent);
  }

  // One further arc from where the bone before it points, so that a straight limb is not twisted. Where limbs
  // hang down in our rest pose, they point elsewhere in the file's: a T pose, for example.
  Quaterniond OnRestPose(size_t j, const Quaterniond& at_rest) {
    const bool is_first = HasHinge(static_cast<Joint>(j));
    const Quaterniond before = is_first || match_.of[j - 1] < 0 ? at_rest : axes_[j - 1];
    const Vector3d& bone = summary_.bone[j];
    if (!(bone.norm() > 0)) return before;  // straight on where the file does not tell
    return Quaterniond::FromTwoVectors(before * Vector3d::UnitY(), bone) * before;
  }

  // Knees bend backwards around our x, elbows forwards.
  static Vector3d HingeOf(size_t j) {
    return j >= static_cast<size_t>(Joint::kLeftThigh) ? Vector3d::UnitX() : Vector3d(-Vector3d::UnitX());
  }

  // A limb tells its plane where it bends 6 degrees in the mean, mostly around one axis. The limits are no
  // fits: they keep out the noise of straight limbs.
  bool HingeIsKnown(size_t j) const {
    return HasHinge(static_cast<Joint>(j)) && summary_.hinge[j].norm() > 0.1 &&
           summary_.hinge[j].norm() > 0.7 * summary_.bend[j];
  }

  bool HingeDenies(size_t j, const Quaterniond& axes) const {
    if (!HingeIsKnown(j)) return false;
    const Vector3d bone = summary_.bone[j].normalized();
    const Vector3d hinge = summary_.hinge[j] - summary_.hinge[j].dot(bone) * bone;
    return hinge.normalized().dot(axes * HingeOf(j)) < std::numbers::sqrt2 / 2;
  }

  Quaterniond FromPoses(size_t j, int parent) const {
    const auto joint = static_cast<Joint>(j);
    const Vector3d& bone = summary_.bone[j];
    std::optional<Quaterniond> frame;
    if (joint == Joint::kPelvis) frame = FrameOf(summary_.hips, -summary_.trunk);
    if (joint == Joint::kChest) frame = FrameOf(summary_.shoulders, -bone);
    if (HingeIsKnown(j)) {
      // The bone is exact, the plane of bending as near as that allows.
      const Vector3d hinge = HingeOf(j).x() * summary_.hinge[j];
      frame = FrameOf(hinge - hinge.dot(bone.normalized()) * bone.normalized(), bone);
    }
    if (frame) return *frame;
    if (parent < 0) return Quaterniond::Identity();  // no trunk and no hips: nothing tells
    const Matrix3d turn =
        axes_[static_cast<size_t>(parent)].conjugate().toRotationMatrix() * summary_.turn[j];
    if (IsClavicle(joint) || !(bone.norm() > 0)) return LeastTurned(turn);
    return LeastTurnedAlong(turn, IsTrunk(joint) ? Vector3d(-Vector3d::UnitY()) : Vector3d(Vector3d::UnitY()),
                            bone);
  }

  // The rotation N with the largest trace of turn * N.
  static Quaterniond LeastTurned(const Matrix3d& turn) {
    const Eigen::JacobiSVD<Matrix3d> svd(turn, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix3d flip = Matrix3d::Identity();
    if ((svd.matrixV() * svd.matrixU().transpose()).determinant() < 0) flip(2, 2) = -1;
    return Quaterniond(Matrix3d(svd.matrixV() * flip * svd.matrixU().transpose()));
  }

  // The same among those that turn `ours` onto `bone`.
  static Quaterniond LeastTurnedAlong(const Matrix3d& turn, const Vector3d& ours, const Vector3d& bone) {
    const Quaterniond onto = Quaterniond::FromTwoVectors(ours, bone);
    const Matrix3d rest = turn * onto.toRotationMatrix();
    const double angle = std::atan2((rest * CrossWith(ours)).trace(), rest.trace() - ours.dot(rest * ours));
    return onto * Quaterniond(Eigen::AngleAxisd(angle, ours));
  }

  const JointMatch& match_;
  const ForeignSummary& summary_;
  const std::optional<Matrix3d>& standing_;
  std::array<bool, kJoints> rest_tells_;
  std::array<Quaterniond, kJoints> axes_;
};

}  // namespace

Vector3d NearestWorldAxis(const Vector3d& v) {
  Eigen::Index k = 0;
  v.cwiseAbs().maxCoeff(&k);
  return (v[k] < 0 ? -1 : 1) * Vector3d::Unit(k);
}

std::optional<Matrix3d> StandingAxes(const ForeignMotion& motion, const JointMatch& match) {
  std::vector<Vector3d> rest;
  for (const ForeignMotion::Joint& joint : motion.joints)
    rest.push_back(joint.parent < 0 ? Vector3d(0, 0, 0)
                                    : Vector3d(rest[static_cast<size_t>(joint.parent)] + joint.offset));
  const auto at = [&](Joint joint) {
    return rest[static_cast<size_t>(match.of[static_cast<size_t>(joint)])];
  };
  const Vector3d hips = 0.5 * (at(Joint::kLeftThigh) + at(Joint::kRightThigh));
  const Vector3d knees = 0.5 * (at(Joint::kLeftShin) + at(Joint::kRightShin));
  const Vector3d shoulders = 0.5 * (at(Joint::kLeftUpperArm) + at(Joint::kRightUpperArm));
  const Vector3d line = at(Joint::kRightThigh) - at(Joint::kLeftThigh);
  const Vector3d up = NearestWorldAxis(hips - knees), side = NearestWorldAxis(line);
  // Nobody stands with legs or trunk further than this from the vertical: a rest pose that does is a drawing
  // of bones, not of a person.
  constexpr double kCosOfLeg = 0.9, kCosOfTrunk = 0.8;
  const auto points = [&](const Vector3d& bone, double cosine) {
    return bone.norm() > 0 && bone.normalized().dot(up) > cosine;
  };
  for (const size_t side_of : {size_t{0}, size_t{1}}) {
    const Vector3d hip = at(side_of == 0 ? Joint::kLeftThigh : Joint::kRightThigh);
    const Vector3d knee = at(side_of == 0 ? Joint::kLeftShin : Joint::kRightShin);
    if (!points(hip - knee, kCosOfLeg)) return std::nullopt;
    const int ankle = match.ankles[side_of];
    if (ankle >= 0 && !points(knee - rest[static_cast<size_t>(ankle)], kCosOfLeg)) return std::nullopt;
  }
  if (!points(shoulders - hips, kCosOfTrunk)) return std::nullopt;
  if (std::abs(up.dot(side)) > 0.5 || !(line.norm() > 0)) return std::nullopt;
  Matrix3d axes;
  axes.row(0) = side;
  axes.row(1) = -up;
  axes.row(2) = side.cross(-up);
  return axes;
}

std::array<Quaterniond, kJoints> NeutralAxes(const JointMatch& match, const ForeignSummary& summary,
                                             const std::optional<Matrix3d>& standing) {
  return Neutral(match, summary, standing).Get();
}

}  // namespace weft
