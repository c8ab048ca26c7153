#include "figure/body.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "figure/capsule.h"

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

// Where each part of the body goes: world_from_model, the model upright with its arms down.
struct BodyFrames {
  struct Limbs {
    Isometry3d clavicle, upper_arm, forearm, hand, thigh, shin;
  };
  Isometry3d pelvis, belly, chest, head;
  std::array<Limbs, 2> sides;  // left, right
};

// Puts the parts together; lengths of a person of 1.80 m, times those of the shape.
class BodyBuilder {
 public:
  BodyBuilder(const BodyShape& shape, double growth, double breath_mm, Body& body)
      : s_(shape),
        skeleton_(SkeletonOf(shape)),
        growth_(growth * shape.stature),
        breath_mm_(breath_mm),
        body_(body) {}

  BodyFrames FramesOf(const BodyPose& pose) const {
    BodyFrames out;
    out.pelvis = Eigen::Translation3d(pose.root_mm) * AngleAxisd(pose.turn, Vector3d::UnitY());
    // Lean and twist are shared along the spine: half at the belly, all at the chest.
    const auto spine = [&](double share) -> Isometry3d {
      const Eigen::Matrix3d turn = (AngleAxisd(share * pose.lean, Vector3d::UnitX()) *
                                    AngleAxisd(share * pose.twist, Vector3d::UnitY()))
                                       .toRotationMatrix();
      return out.pelvis * TurnAbout(skeleton_.At(Joint::kSpine), turn);
    };
    out.belly = spine(0.5);
    out.chest = out.head = spine(1);
    for (const int side : {0, 1}) {
      const BodyPose::Limbs& limbs = side == 0 ? pose.left : pose.right;
      BodyFrames::Limbs& to = out.sides[side];
      const Eigen::Matrix3d raise = (AngleAxisd(-limbs.arm_forward, Vector3d::UnitX()) *
                                     AngleAxisd(-SignOf(side) * limbs.arm_out, Vector3d::UnitZ()))
                                        .toRotationMatrix();
      to.clavicle = out.chest;
      to.upper_arm = out.chest * TurnAbout(Arm(side, 1), raise);
      to.forearm = to.upper_arm *
                   TurnAbout(Arm(side, 2), AngleAxisd(-limbs.elbow, Vector3d::UnitX()).toRotationMatrix());
      to.hand = to.forearm;
      to.thigh = out.pelvis * TurnAbout(Leg(side, 0),
                                        AngleAxisd(-limbs.leg_forward, Vector3d::UnitX()).toRotationMatrix());
      to.shin =
          to.thigh * TurnAbout(Leg(side, 1), AngleAxisd(limbs.knee, Vector3d::UnitX()).toRotationMatrix());
    }
    return out;
  }

  BodyFrames FramesOf(const FigurePose& pose) const {
    const auto world = WorldFromRest(skeleton_, pose);
    const auto of = [&](Joint joint, int after = 0) { return world[static_cast<size_t>(joint) + after]; };
    BodyFrames out = {of(Joint::kPelvis), of(Joint::kSpine), of(Joint::kChest), of(Joint::kHead), {}};
    for (const int side : {0, 1}) {
      const Joint arm = side == 0 ? Joint::kLeftClavicle : Joint::kRightClavicle;
      const Joint leg = side == 0 ? Joint::kLeftThigh : Joint::kRightThigh;
      out.sides[side] = {of(arm), of(arm, 1), of(arm, 2), of(arm, 3), of(leg), of(leg, 1)};
    }
    return out;
  }

  void Build(const BodyFrames& frames) {
    body_.world_from_pelvis_ = frames.pelvis;
    body_.world_from_chest_ = frames.chest;
    const double breath = breath_mm_ / s_.stature, depth = s_.belly_depth, wide = s_.shoulder_width;
    const double chest = s_.chest_girth, waist = s_.waist_girth, hip = s_.hip_girth, neck = s_.neck_girth;
    Add(0, frames.pelvis, Trunk(0, 95, 0), Trunk(0, 190, 0), 141 * hip, 158 * hip, 0.68 * depth);
    Add(0, frames.belly, Trunk(0, -110, 0), Trunk(0, 75, 0), (136 + breath / 2) * waist, 135 * waist,
        0.72 * depth);
    Add(0, frames.chest, Trunk(0, -235, 0), Trunk(0, -130, 0), (148 + breath) * chest, (146 + breath) * chest,
        0.70 * depth);
    for (const int side : {0, 1}) {
      const double x = SignOf(side) * wide;
      const Isometry3d& clavicle = frames.sides[side].clavicle;
      Add(0, clavicle, Trunk(x * 60, -280, 0), Trunk(x * 158, -277, 0), 62 * chest, 56 * chest, 1);
      Add(0, clavicle, Trunk(x * 15, -345, 8), Trunk(x * 150, -288, 5), 40 * neck, 44 * neck, 1);
    }
    Add(0, frames.chest, Trunk(0, -300, 6), Trunk(0, -420, -12), 60 * neck, 53 * neck, 1);
    Add(0, frames.head, Trunk(0, -465, -30), Trunk(0, -545, -14), 62, 80, 1.2);
    for (const int side : {0, 1}) AddArm(1 + side, side, frames.sides[side]);
    for (const int side : {0, 1}) AddLeg(3 + side, side, frames.sides[side]);
  }

 private:
  static double SignOf(int side) { return side == 0 ? -1 : 1; }
  Vector3d Trunk(double x, double y, double z) const {
    return s_.stature * Vector3d(x, y * s_.torso_length, z);
  }
  // Clavicle, shoulder, elbow, wrist.
  const Vector3d& Arm(int side, int k) const {
    return skeleton_
        .rest_mm[static_cast<size_t>(side == 0 ? Joint::kLeftClavicle : Joint::kRightClavicle) + k];
  }
  // Hip, knee.
  const Vector3d& Leg(int side, int k) const {
    return skeleton_.rest_mm[static_cast<size_t>(side == 0 ? Joint::kLeftThigh : Joint::kRightThigh) + k];
  }

  void Add(int group, const Isometry3d& world, const Vector3d& a, const Vector3d& b, double ra, double rb,
           double depth) {
    body_.parts_.push_back({world * a, world * b, growth_ * ra, growth_ * rb, world.linear(), depth, group});
  }

  void AddArm(int group, int side, const BodyFrames::Limbs& limbs) {
    const Vector3d& elbow = Arm(side, 2);
    const double length = s_.stature * s_.arm_length, girth = s_.arm_girth;
    Add(group, limbs.upper_arm, Arm(side, 1), elbow, 53 * girth, 41 * girth, 1);
    Add(group, limbs.forearm, elbow, elbow + Vector3d(0, 245 * length, 0), 41 * girth, 29 * girth, 1);
    Add(group, limbs.hand, elbow + Vector3d(0, 270 * length, 0),
        elbow + Vector3d(0, 345 * length, -5 * length), 38, 30, 0.55);
  }

  void AddLeg(int group, int side, const BodyFrames::Limbs& limbs) {
    const Vector3d &hip = Leg(side, 0), &knee = Leg(side, 1);
    const Vector3d& ankle = side == 0 ? skeleton_.left_ankle_mm : skeleton_.right_ankle_mm;
    Add(group, limbs.thigh, hip, knee, 88 * s_.leg_girth, 58 * s_.leg_girth, 1);
    Add(group, limbs.shin, knee, ankle, 58 * s_.leg_girth, 38 * s_.leg_girth, 1);
  }

  const BodyShape& s_;
  const Skeleton skeleton_;
  const double growth_, breath_mm_;
  Body& body_;
};

Body::Body(const BodyPose& pose, double growth, const BodyShape& shape) {
  BodyBuilder builder(shape, growth, pose.breath_mm, *this);
  builder.Build(builder.FramesOf(pose));
}

Body::Body(const FigurePose& pose, const BodyShape& shape) {
  BodyBuilder builder(shape, 1, 0, *this);
  builder.Build(builder.FramesOf(pose));
}

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

size_t Body::NearestPart(const Vector3d& p_mm) const {
  size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < parts_.size(); ++k) {
    const double distance = DistanceToPart(parts_[k], p_mm).distance_mm;
    if (distance < least) least = distance, nearest = k;
  }
  return nearest;
}

Vector3d Body::PlaceIn(const Body& other, const Vector3d& p_mm) const {
  const size_t nearest = NearestPart(p_mm);
  const Part &here = parts_[nearest], &there = other.parts_[nearest];
  return there.a + there.axes * (here.axes.transpose() * (p_mm - here.a));
}

Eigen::Isometry3d Body::MotionTo(const Body& other, const Vector3d& p_mm) const {
  const size_t nearest = NearestPart(p_mm);
  const Part &here = parts_[nearest], &there = other.parts_[nearest];
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = there.axes * here.axes.transpose();
  out.translation() = there.a - out.linear() * here.a;
  return out;
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
