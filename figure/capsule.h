// Meshes of tapered capsules, for bodies and hands.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// Distance to a surface and its direction.
struct SurfaceDistance {
  double distance_mm = 0;  // negative inside; exact near the surface to a few percent
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, outwards
};

// Spheres of radius ra .. rb along a .. b.
struct Capsule {
  Eigen::Vector3d a, b;
  double ra = 0, rb = 0;
};

// Exact, but for places nearest to the rim between flank and cap.
SurfaceDistance DistanceTo(const Capsule& capsule, const Eigen::Vector3d& p);

inline constexpr int kCapsuleAround = 32, kCapsuleAlong = 14, kCapsuleCap = 8;

// Vertices of a capsule's mesh and its faces, numbered from `first_vertex` on; every capsule has as many.
std::vector<Eigen::Vector3d> CapsuleVertices(const Capsule& capsule);
void AppendCapsuleFaces(int first_vertex, std::vector<Face>& faces);
int CapsuleVertexCount();

}  // namespace weft
