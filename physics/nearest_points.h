// Nearest points of a point and a triangle, and of two segments.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "alignment/untangle/closest_points.h"

namespace weft {

// The vector between the nearest points is the sum of weight times point, in the order of the arguments;
// normal is its direction, zero where they touch.
struct NearestPoints {
  std::array<float, 4> weight;
  Eigen::Vector3d normal;
  float distance_mm = 0;
};

namespace internal {

inline NearestPoints Between(const Eigen::Vector3d& difference, const std::array<double, 4>& weight) {
  NearestPoints out;
  for (int k = 0; k < 4; ++k) out.weight[k] = static_cast<float>(weight[k]);
  const double distance = difference.norm();
  out.distance_mm = static_cast<float>(distance);
  out.normal = distance > 0 ? Eigen::Vector3d(difference / distance) : Eigen::Vector3d::Zero();
  return out;
}

}  // namespace internal

inline NearestPoints NearestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                       const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d shares = ClosestOnTriangle(p, a, b, c);
  const double v = shares.y(), w = shares.z(), u = shares.x() > 0 ? 1 - v - w : 0;
  return internal::Between(p - u * a - v * b - w * c, {1, -u, -v, -w});
}

// Segments a b and c d, none without length (Ericson 2005, 5.1.9).
inline NearestPoints NearestOfEdges(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  const Eigen::Vector3d d1 = b - a, d2 = d - c, r = a - c;
  const double aa = d1.squaredNorm(), ee = d2.squaredNorm(), f = d2.dot(r), cc = d1.dot(r), bb = d1.dot(d2);
  const double denominator = aa * ee - bb * bb;
  double s = denominator > 1e-12 * aa * ee ? std::clamp((bb * f - cc * ee) / denominator, 0.0, 1.0) : 0.5;
  double t = (bb * s + f) / ee;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((bb * t - cc) / aa, 0.0, 1.0);
  }
  return internal::Between(r + s * d1 - t * d2, {1 - s, s, t - 1, -t});
}

}  // namespace weft
