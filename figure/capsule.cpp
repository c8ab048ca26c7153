#include "figure/capsule.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

// Rings from the pole at a to the pole at b: the cap around a, the flank, the cap around b.
constexpr int kRings = 2 * (kCapsuleCap - 1) + kCapsuleAlong;

}  // namespace

SurfaceDistance DistanceTo(const Capsule& capsule, const Eigen::Vector3d& p) {
  const Eigen::Vector3d axis = capsule.b - capsule.a, q = p - capsule.a;
  const double length = axis.norm();
  const double along = q.dot(axis) / length;
  const double across = std::sqrt(std::max(0.0, q.squaredNorm() - along * along));
  const double slope = std::clamp((capsule.ra - capsule.rb) / length, -0.99, 0.99);
  // The nearest sphere of a cone lies where the distance is stationary along the axis.
  const double t = std::clamp((along + across * slope / std::sqrt(1 - slope * slope)) / length, 0.0, 1.0);
  Eigen::Vector3d from = q - t * axis;
  if (from.squaredNorm() < 1e-12) from = 1e-6 * axis.unitOrthogonal();  // on the axis any direction will do
  const double distance = from.norm();
  return {distance - capsule.ra - t * (capsule.rb - capsule.ra), from / distance};
}

int CapsuleVertexCount() { return 2 + kRings * kCapsuleAround; }

std::vector<Eigen::Vector3d> CapsuleVertices(const Capsule& capsule) {
  const Eigen::Vector3d axis = capsule.b - capsule.a;
  const double length = std::max(axis.norm(), 1e-9);
  const Eigen::Vector3d w = axis / length, u = w.unitOrthogonal(), v = w.cross(u);
  // The flank touches the spheres where the angle to the axis is 90 degrees plus the taper.
  const double taper = std::asin(std::clamp((capsule.ra - capsule.rb) / length, -0.99, 0.99));
  const double half = std::numbers::pi / 2;
  std::vector<Eigen::Vector3d> out = {capsule.a - capsule.ra * w};
  const auto add_ring = [&](double along, double elevation) {  // elevation from the pole at b's side
    const double radius = capsule.ra + along * (capsule.rb - capsule.ra);
    const Eigen::Vector3d center = capsule.a + along * axis + radius * std::sin(elevation) * w;
    for (int k = 0; k < kCapsuleAround; ++k) {
      const double angle = 2 * std::numbers::pi * k / kCapsuleAround;
      out.push_back(center + radius * std::cos(elevation) * (std::cos(angle) * u + std::sin(angle) * v));
    }
  };
  for (int i = 1; i < kCapsuleCap; ++i) add_ring(0, -half + (taper + half) * i / kCapsuleCap);
  for (int i = 0; i < kCapsuleAlong; ++i) add_ring(static_cast<double>(i) / (kCapsuleAlong - 1), taper);
  for (int i = 1; i < kCapsuleCap; ++i) add_ring(1, taper + (half - taper) * i / kCapsuleCap);
  out.push_back(capsule.b + capsule.rb * w);
  return out;
}

void AppendCapsuleFaces(int first_vertex, std::vector<Face>& faces) {
  const auto at = [&](int ring, int k) {
    return first_vertex + 1 + ring * kCapsuleAround + k % kCapsuleAround;
  };
  const int last = first_vertex + CapsuleVertexCount() - 1;
  for (int k = 0; k < kCapsuleAround; ++k) {
    faces.push_back({first_vertex, at(0, k + 1), at(0, k)});
    for (int r = 0; r + 1 < kRings; ++r) {
      faces.push_back({at(r, k), at(r, k + 1), at(r + 1, k + 1)});
      faces.push_back({at(r, k), at(r + 1, k + 1), at(r + 1, k)});
    }
    faces.push_back({last, at(kRings - 1, k), at(kRings - 1, k + 1)});
  }
}

}  // namespace weft
