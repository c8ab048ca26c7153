// A hand of capsules that takes hold of cloth: collision shape and mesh.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "alignment/mesh.h"
#include "figure/capsule.h"

namespace weft {

// A hand that belongs to nobody: pinches with thumb and forefinger at `grip_mm`, comes from `away`.
struct HandPose {
  Eigen::Vector3d grip_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d away = -Eigen::Vector3d::UnitZ();  // unit, from the grip towards the wrist
  double opening_mm = 0;                             // the finger tips are farther apart than closed
};

// A posed hand. Immutable; any number of threads may ask.
class Hand {
 public:
  explicit Hand(const HandPose& pose);

  SurfaceDistance DistanceTo(const Eigen::Vector3d& p_mm) const;
  // False for places that are farther away than that; true for those nearby.
  bool IsWithin(const Eigen::Vector3d& p_mm, double far_mm) const {
    return box_mm_.squaredExteriorDistance(p_mm) <= far_mm * far_mm;
  }
  // Where the bone nearest to `p_mm` had that point in an earlier or later pose.
  Eigen::Vector3d PlaceIn(const Hand& other, const Eigen::Vector3d& p_mm) const;

  // Middles of the tips of thumb and forefinger.
  std::array<Eigen::Vector3d, 2> Tips() const;

  // Counter-clockwise seen from outside, the same faces in every pose.
  std::vector<Eigen::Vector3d> MeshVertices() const;
  static const std::vector<Face>& MeshFaces();

 private:
  size_t NearestBone(const Eigen::Vector3d& p_mm) const;

  std::vector<Capsule> bones_;
  Eigen::AlignedBox3d box_mm_;
};

}  // namespace weft
