#include "figure/hand.h"

#include <algorithm>

namespace weft {
namespace {

using Eigen::Vector3d;

constexpr size_t kThumbTip = 1, kForefingerTip = 3;  // bones that end in a tip, at b

// Palm, wrist, and two bones each of thumb and four fingers; the grip is at the origin, the wrist at +z.
std::vector<Capsule> BonesOf(double opening_mm) {
  const double gap = opening_mm / 2;
  std::vector<Capsule> out;
  const Vector3d thumb_tip(0, 8 + gap, 4), thumb_joint(-8, 26 + gap, 34), thumb_root(-10, 34, 70);
  const Vector3d tip(0, -8 - gap, 4), joint(-4, -34 - gap, 28), root(0, -24, 82);
  out.push_back({thumb_root, thumb_joint, 14, 11});
  out.push_back({thumb_joint, thumb_tip, 11, 7.5});
  out.push_back({root, joint, 11, 9});
  out.push_back({joint, tip, 9, 7});
  for (int k = 1; k <= 3; ++k) {  // the other fingers are bent
    const Vector3d knuckle(18.0 * k, -24 + 2 * k, 84 + 3 * k), bend(18.0 * k, -40, 48 + 4 * k);
    out.push_back({knuckle, bend, 10.5 - 0.7 * k, 9 - 0.6 * k});
    out.push_back({bend, Vector3d(17.0 * k, -8, 44 + 5 * k), 9 - 0.6 * k, 7.5 - 0.5 * k});
    out.push_back({Vector3d(16.0 * k, 2, 135), knuckle, 17, 13});
  }
  out.push_back({Vector3d(8, 4, 135), root, 18, 14});
  out.push_back({Vector3d(22, 4, 140), Vector3d(22, 6, 330), 26, 36});
  return out;
}

}  // namespace

Hand::Hand(const HandPose& pose) : bones_(BonesOf(pose.opening_mm)) {
  const Vector3d z = pose.away.normalized();
  const Vector3d y = (Vector3d::UnitY() - z.y() * z).normalized(), x = y.cross(z);
  Eigen::Matrix3d axes;
  axes << x, y, z;
  for (Capsule& bone : bones_) {
    bone.a = pose.grip_mm + axes * bone.a, bone.b = pose.grip_mm + axes * bone.b;
    const Vector3d thickness = Vector3d::Constant(std::max(bone.ra, bone.rb));
    for (const Vector3d& end : {bone.a, bone.b}) {
      box_mm_.extend(end - thickness);
      box_mm_.extend(end + thickness);
    }
  }
}

size_t Hand::NearestBone(const Vector3d& p) const {
  const auto distance = [&](const Capsule& bone) { return weft::DistanceTo(bone, p).distance_mm; };
  return std::min_element(bones_.begin(), bones_.end(),
                          [&](const Capsule& a, const Capsule& b) { return distance(a) < distance(b); }) -
         bones_.begin();
}

SurfaceDistance Hand::DistanceTo(const Vector3d& p) const {
  return weft::DistanceTo(bones_[NearestBone(p)], p);
}

Vector3d Hand::PlaceIn(const Hand& other, const Vector3d& p) const {
  const size_t bone = NearestBone(p);
  const Capsule &here = bones_[bone], &there = other.bones_[bone];
  const Vector3d axis = here.b - here.a;
  const double t = std::clamp((p - here.a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return p + (1 - t) * (there.a - here.a) + t * (there.b - here.b);
}

std::array<Vector3d, 2> Hand::Tips() const { return {bones_[kThumbTip].b, bones_[kForefingerTip].b}; }

std::vector<Vector3d> Hand::MeshVertices() const {
  std::vector<Vector3d> out;
  for (const Capsule& bone : bones_)
    for (const Vector3d& p : CapsuleVertices(bone)) out.push_back(p);
  return out;
}

const std::vector<Face>& Hand::MeshFaces() {
  static const std::vector<Face> faces = [] {
    std::vector<Face> out;
    const size_t bones = BonesOf(0).size();
    for (size_t i = 0; i < bones; ++i) AppendCapsuleFaces(static_cast<int>(i) * CapsuleVertexCount(), out);
    return out;
  }();
  return faces;
}

}  // namespace weft
