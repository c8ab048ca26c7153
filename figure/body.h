// A person of blended tapered capsules, posed by a few joint angles: collision shape and mesh.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "alignment/mesh.h"
#include "figure/capsule.h"
#include "figure/pose.h"

namespace weft {

// Angles in radians; all zero: upright, arms and legs straight down. World axes (y down, looks towards -z);
// "left" is the side of -x.
struct BodyPose {
  Eigen::Vector3d root_mm = Eigen::Vector3d::Zero();  // of the pelvis
  double lean = 0;                                    // forwards, of everything above the pelvis
  double turn = 0;                                    // of the pelvis around the vertical
  double twist = 0;                                   // of the chest against the pelvis, around the spine
  double breath_mm = 0;                               // by how much the chest is wider than at rest
  struct Limbs {
    double arm_out = 0, arm_forward = 0, elbow = 0;  // shoulder to the side and forwards, elbow bent
    double leg_forward = 0, knee = 0;
  };
  Limbs left, right;
};

// share 0: a, 1: b.
BodyPose Mix(const BodyPose& a, const BodyPose& b, double share);

// A posed body. `growth` scales every thickness, so that a body can grow into a garment. Immutable; any
// number of threads may ask.
class Body {
 public:
  explicit Body(const BodyPose& pose, double growth = 1, const BodyShape& shape = BodyShape());
  explicit Body(const FigurePose& pose, const BodyShape& shape = BodyShape());

  SurfaceDistance DistanceTo(const Eigen::Vector3d& p_mm) const;
  // Distance is not needed beyond `far_mm`: empty boxes answer quickly with that.
  SurfaceDistance DistanceWithin(const Eigen::Vector3d& p_mm, double far_mm) const;

  // Where the part nearest to `p_mm` had that point in an earlier or later pose.
  Eigen::Vector3d PlaceIn(const Body& other, const Eigen::Vector3d& p_mm) const;
  // How that part moves to that pose.
  Eigen::Isometry3d MotionTo(const Body& other, const Eigen::Vector3d& p_mm) const;

  // The mesh's vertices lie on the parts' surfaces, moved onto the blended one where parts meet.
  std::vector<Eigen::Vector3d> MeshVertices() const;
  static const std::vector<Face>& MeshFaces();

  const Eigen::Isometry3d& world_from_pelvis() const { return world_from_pelvis_; }
  const Eigen::Isometry3d& world_from_chest() const { return world_from_chest_; }

 private:
  // Spheres of radius ra .. rb along a .. b; space is scaled by `depth` along the third axis of `axes`.
  struct Part {
    Eigen::Vector3d a, b;
    double ra = 0, rb = 0;
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // world from part, orthonormal
    double depth = 1;
    int group = 0;  // trunk, left arm, right arm, left leg, right leg
  };
  static constexpr int kGroups = 5;
  friend class BodyBuilder;

  size_t NearestPart(const Eigen::Vector3d& p_mm) const;
  static SurfaceDistance DistanceToPart(const Part& part, const Eigen::Vector3d& p);

  std::vector<Part> parts_;
  Eigen::Isometry3d world_from_pelvis_, world_from_chest_;
};

}  // namespace weft
