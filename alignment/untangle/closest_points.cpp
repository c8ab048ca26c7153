#include "alignment/untangle/closest_points.h"

#include <algorithm>

namespace weft {

Eigen::Vector3d ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                  const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const double ab_a = ab.dot(p - a), ac_a = ac.dot(p - a);
  if (ab_a <= 0 && ac_a <= 0) return {1, 0, 0};
  const double ab_b = ab.dot(p - b), ac_b = ac.dot(p - b);
  if (ab_b >= 0 && ac_b <= ab_b) return {0, 1, 0};
  const double ab_c = ab.dot(p - c), ac_c = ac.dot(p - c);
  if (ac_c >= 0 && ab_c <= ac_c) return {0, 0, 1};
  const double beside_ab = ab_a * ac_b - ab_b * ac_a;
  if (beside_ab <= 0 && ab_a >= 0 && ab_b <= 0) {
    const double t = ab_a / (ab_a - ab_b);
    return {1 - t, t, 0};
  }
  const double beside_ac = ab_c * ac_a - ab_a * ac_c;
  if (beside_ac <= 0 && ac_a >= 0 && ac_c <= 0) {
    const double t = ac_a / (ac_a - ac_c);
    return {1 - t, 0, t};
  }
  const double beside_bc = ab_b * ac_c - ab_c * ac_b, along = ac_b - ab_b, back = ab_c - ac_c;
  if (beside_bc <= 0 && along >= 0 && back >= 0) {
    const double t = along + back > 0 ? along / (along + back) : 0;
    return {0, 1 - t, t};
  }
  const double sum = beside_bc + beside_ac + beside_ab;
  if (!(sum > 0)) return {1, 0, 0};
  return {beside_bc / sum, beside_ac / sum, beside_ab / sum};
}

Eigen::Vector2d ClosestOnSegments(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1,
                                  const Eigen::Vector3d& q0, const Eigen::Vector3d& q1) {
  const Eigen::Vector3d p = p1 - p0, q = q1 - q0, r = p0 - q0;
  const double pp = p.squaredNorm(), qq = q.squaredNorm(), pq = p.dot(q), pr = p.dot(r), qr = q.dot(r);
  const auto share = [](double along, double whole) {
    return whole > 0 ? std::clamp(along / whole, 0.0, 1.0) : 0.0;
  };
  const double across = pp * qq - pq * pq;
  // Nearly parallel ones: any start serves, the second step finds the place opposite.
  double s = across > 1e-12 * pp * qq ? std::clamp((pq * qr - pr * qq) / across, 0.0, 1.0) : 0.5;
  const double t = share(pq * s + qr, qq);
  s = share(pq * t - pr, pp);
  return {s, t};
}

}  // namespace weft
