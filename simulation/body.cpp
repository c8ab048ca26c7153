#include "simulation/body.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/capsule.h"

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// Blend radii: parts of a group grow into each other, a limb into the trunk.
constexpr double kBlendWithinMm = 28;
constexpr double kBlendLimbMm = 22;

Isometry3d TurnAbout(const Vector3d& pivot, const Eigen::Matrix3d& rotation) {
  Isometry3d out = Isometry3d::Identity();
  out.linear() = rotation;
  out.translation() = pivot - rotation * pivot;
  return out;
}

// Smooth minimum of two distances (Quilez' polynomial one), normals blended alike.
SurfaceDistance Blend(const SurfaceDistance& a, const SurfaceDistance& b, double radius) {
  const double share = std::clamp(0.5 + 0.5 * (b.distance_mm - a.distance_mm) / radius, 0.0, 1.0);
  SurfaceDistance out;
  out.distance_mm = share * a.distance_mm + (1 - share) * b.distance_mm - radius * share * (1 - share);
  out.normal = share * a.normal + (1 - share) * b.normal;
  return out;
}

}  // namespace

BodyPose Mix(const BodyPose& a, const BodyPose& b, double share) {
  const auto mix = [share](double p, double q) { return p + share * (q - p); };
  const auto limbs = [&](const BodyPose::Limbs& p, const BodyPose::Limbs& q) {
    return BodyPose::Limbs{mix(p.arm_out, q.arm_out), mix(p.arm_forward, q.arm_forward),
                           mix(p.elbow, q.elbow), mix(p.leg_forward, q.leg_forward), mix(p.knee, q.knee)};
  };
  BodyPose out;
  out.root_mm = a.root_mm + share * (b.root_mm - a.root_mm);
  out.lean = mix(a.lean, b.lean), out.turn = mix(a.turn, b.turn), out.twist = mix(a.twist, b.twist);
  out.breath_mm = mix(a.breath_mm, b.breath_mm);
  out.left = limbs(a.left, b.left), out.right = limbs(a.right, b.right);
  return out;
}

// Puts the parts together; lengths of a person of 1.80 m.
class BodyBuilder {
 public:
  BodyBuilder(const BodyPose& pose, double growth, Body& body) : pose_(pose), growth_(growth), body_(body) {}

  void Build() {
    Isometry3d& pelvis = body_.world_from_pelvis_;
    pelvis = Eigen::Translation3d(pose_.root_mm) * AngleAxisd(pose_.turn, Vector3d::UnitY());
    // Lean and twist are shared along the spine: half at the belly, all at the chest.
    const auto spine = [&](double share) -> Isometry3d {
      const Eigen::Matrix3d turn = (AngleAxisd(share * pose_.lean, Vector3d::UnitX()) *
                                    AngleAxisd(share * pose_.twist, Vector3d::UnitY()))
                                       .toRotationMatrix();
      return pelvis * TurnAbout(Vector3d(0, 60, 0), turn);
    };
    const Isometry3d belly = spine(0.5);
    Isometry3d& chest = body_.world_from_chest_;
    chest = spine(1);
    const double breath = pose_.breath_mm;
    Add(0, pelvis, {0, 95, 0}, {0, 190, 0}, 141, 158, 0.68);
    Add(0, belly, {0, -110, 0}, {0, 75, 0}, 136 + breath / 2, 135, 0.72);
    Add(0, chest, {0, -235, 0}, {0, -130, 0}, 148 + breath, 146 + breath, 0.70);
    for (const double side : {-1.0, 1.0}) {
      Add(0, chest, {side * 60, -280, 0}, {side * 158, -277, 0}, 62, 56, 1);
      Add(0, chest, {side * 15, -345, 8}, {side * 150, -288, 5}, 40, 44, 1);
    }
    Add(0, chest, {0, -300, 6}, {0, -420, -12}, 60, 53, 1);
    Add(0, chest, {0, -465, -30}, {0, -545, -14}, 62, 80, 1.2);
    AddArm(1, chest, -1, pose_.left);
    AddArm(2, chest, 1, pose_.right);
    AddLeg(3, pelvis, -1, pose_.left);
    AddLeg(4, pelvis, 1, pose_.right);
  }

 private:
  void Add(int group, const Isometry3d& world, const Vector3d& a, const Vector3d& b, double ra, double rb,
           double depth) {
    body_.parts_.push_back({world * a, world * b, growth_ * ra, growth_ * rb, world.linear(), depth, group});
  }

  void AddArm(int group, const Isometry3d& chest, double side, const BodyPose::Limbs& limbs) {
    const Vector3d shoulder(side * 172, -275, 0), elbow = shoulder + Vector3d(0, 290, 0);
    const Eigen::Matrix3d raise = (AngleAxisd(-limbs.arm_forward, Vector3d::UnitX()) *
                                   AngleAxisd(-side * limbs.arm_out, Vector3d::UnitZ()))
                                      .toRotationMatrix();
    const Isometry3d upper = chest * TurnAbout(shoulder, raise);
    const Isometry3d lower =
        upper * TurnAbout(elbow, AngleAxisd(-limbs.elbow, Vector3d::UnitX()).toRotationMatrix());
    Add(group, upper, shoulder, elbow, 53, 41, 1);
    Add(group, lower, elbow, elbow + Vector3d(0, 245, 0), 41, 29, 1);
    Add(group, lower, elbow + Vector3d(0, 270, 0), elbow + Vector3d(0, 345, -5), 38, 30, 0.55);
  }

  void AddLeg(int group, const Isometry3d& pelvis, double side, const BodyPose::Limbs& limbs) {
    const Vector3d hip(side * 82, 210, 0), knee = hip + Vector3d(0, 420, 0);
    const Isometry3d upper =
        pelvis * TurnAbout(hip, AngleAxisd(-limbs.leg_forward, Vector3d::UnitX()).toRotationMatrix());
    const Isometry3d lower =
        upper * TurnAbout(knee, AngleAxisd(limbs.knee, Vector3d::UnitX()).toRotationMatrix());
    Add(group, upper, hip, knee, 88, 58, 1);
    Add(group, lower, knee, knee + Vector3d(0, 410, 0), 58, 38, 1);
  }

  const BodyPose& pose_;
  const double growth_;
  Body& body_;
};

Body::Body(const BodyPose& pose, double growth) { BodyBuilder(pose, growth, *this).Build(); }

SurfaceDistance Body::DistanceToPart(const Part& part, const Vector3d& p) {
  // In the part's axes, with the depth taken out: a capsule.
  const auto local = [&](const Vector3d& q) -> Vector3d {
    Vector3d out = part.axes.transpose() * q;
    out.z() /= part.depth;
    return out;
  };
  SurfaceDistance out =
      weft::DistanceTo({Vector3d::Zero(), local(part.b - part.a), part.ra, part.rb}, local(p - part.a));
  out.normal.z() /= part.depth;
  const double size = out.normal.norm();
  return {out.distance_mm / size, part.axes * (out.normal / size)};
}

SurfaceDistance Body::DistanceWithin(const Vector3d& p_mm, double far_mm) const {
  std::array<SurfaceDistance, kGroups> of_group;
  for (SurfaceDistance& d : of_group) d.distance_mm = std::numeric_limits<double>::infinity();
  const double reach = far_mm + kBlendWithinMm;
  for (const Part& part : parts_) {
    const double size = std::max(part.ra, part.rb) * std::max(1.0, part.depth) + reach;
    const Vector3d axis = part.b - part.a;
    const double t = std::clamp((p_mm - part.a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    if ((p_mm - part.a - t * axis).squaredNorm() > size * size) continue;
    const SurfaceDistance d = DistanceToPart(part, p_mm);
    SurfaceDistance& group = of_group[part.group];
    group = std::isinf(group.distance_mm) ? d : Blend(group, d, kBlendWithinMm);
  }
  SurfaceDistance out = of_group[0];
  for (int g = 1; g < kGroups; ++g) {
    if (std::isinf(of_group[g].distance_mm)) continue;
    out = std::isinf(out.distance_mm) ? of_group[g] : Blend(out, of_group[g], kBlendLimbMm);
  }
  if (std::isinf(out.distance_mm)) return {far_mm, Vector3d::UnitY()};
  out.normal.normalize();
  return out;
}

SurfaceDistance Body::DistanceTo(const Vector3d& p_mm) const { return DistanceWithin(p_mm, 1e6); }

Vector3d Body::PlaceIn(const Body& other, const Vector3d& p_mm) const {
  size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < parts_.size(); ++k) {
    const double distance = DistanceToPart(parts_[k], p_mm).distance_mm;
    if (distance < least) least = distance, nearest = k;
  }
  const Part &here = parts_[nearest], &there = other.parts_[nearest];
  return there.a + there.axes * (here.axes.transpose() * (p_mm - here.a));
}

std::vector<Vector3d> Body::MeshVertices() const {
  std::vector<Vector3d> out;
  for (const Part& part : parts_) {
    const auto scaled = [&](Vector3d q) {
      q.z() /= part.depth;
      return q;
    };
    const Vector3d a = scaled(part.axes.transpose() * part.a), b = scaled(part.axes.transpose() * part.b);
    for (Vector3d p : CapsuleVertices({a, b, part.ra, part.rb})) {
      p.z() *= part.depth;
      p = part.axes * p;
      // Onto the blended surface, unless that lies deep inside another part and is not seen.
      SurfaceDistance d = DistanceWithin(p, kBlendWithinMm);
      for (int i = 0; i < 3 && d.distance_mm > -kBlendWithinMm; ++i) {
        const Vector3d next = p - d.distance_mm * d.normal;
        const SurfaceDistance there = DistanceWithin(next, kBlendWithinMm);
        if (std::abs(there.distance_mm) >= std::abs(d.distance_mm)) break;
        p = next, d = there;
      }
      // Where another part is nearer, its mesh is to be seen: this one stays a little below.
      const SurfaceDistance own = DistanceToPart(part, p);
      double least = own.distance_mm;
      for (const Part& other : parts_) least = std::min(least, DistanceToPart(other, p).distance_mm);
      p -= std::min(4.0, 0.5 * (own.distance_mm - least)) * own.normal;
      out.push_back(p);
    }
  }
  return out;
}

const std::vector<Face>& Body::MeshFaces() {
  static const std::vector<Face> faces = [] {
    std::vector<Face> out;
    const size_t parts = Body(BodyPose()).parts_.size();
    for (size_t i = 0; i < parts; ++i) AppendCapsuleFaces(static_cast<int>(i) * CapsuleVertexCount(), out);
    return out;
  }();
  return faces;
}

}  // namespace weft
