// Nearest points of corners, sides and triangles.
#pragma once

#include <Eigen/Core>

namespace weft {

// The point of the triangle nearest to p, as weights of its corners (Ericson 2005, section 5.1.5).
Eigen::Vector3d ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c);

// The points of two segments nearest to each other, as shares of the way from p0 to p1 and from q0 to q1.
Eigen::Vector2d ClosestOnSegments(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1,
                                  const Eigen::Vector3d& q0, const Eigen::Vector3d& q1);

}  // namespace weft
