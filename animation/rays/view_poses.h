// Where a known shape may stand that a few views see: a start for fits that improve a pose step by step.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "animation/rays/evidence.h"

namespace weft {

// Of each view with enough rays the scaled orthographic pose (DeMenthon and Davis 1995) of `points_mm`, the
// rays' vertices in the shape's axes, and seven more, turned by 45 degrees each about `turn_axis` of the
// shape. Poses bring the shape into the world.
std::vector<Eigen::Isometry3d> PosesFromViews(const std::vector<VertexRay>& rays,
                                              const std::vector<Eigen::Vector3d>& points_mm,
                                              const Eigen::Vector3d& turn_axis);

// The direction in which points lie furthest from the origin.
Eigen::Vector3d LongAxis(const std::vector<Eigen::Vector3d>& points_mm);

// Two directions across a ray.
inline void AcrossOf(const Eigen::Vector3d& direction, Eigen::Vector3d* a, Eigen::Vector3d* b) {
  *a = direction.unitOrthogonal();
  *b = direction.cross(*a);
}

}  // namespace weft
