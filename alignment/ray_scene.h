// Ray casts against one triangle mesh (Embree).
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

// Where a ray meets the mesh first; face -1 where it does not.
struct RayHit {
  int face = -1;
  float distance_mm = std::numeric_limits<float>::infinity();
  float weight_b = 0, weight_c = 0;  // barycentric weights of the face's second and third corner
  bool from_outside = false;         // the face is seen counter-clockwise
};

// A mesh prepared for ray casts. Immutable; any number of threads may cast at once. Casts without a time are
// those of the middle of the exposure.
class RayScene {
 public:
  // `path_mm` [vertices]: the way of each vertex while the shutter is open; it is at `vertices_mm` half-way.
  // Empty for a mesh at rest. InvalidArgument: face indices out of range, sizes that differ, or vertices not
  // finite. Internal: Embree's own message.
  static absl::StatusOr<RayScene> Build(const std::vector<Eigen::Vector3d>& vertices_mm,
                                        const std::vector<Face>& faces,
                                        const std::vector<Eigen::Vector3d>& path_mm = {});

  RayHit Cast(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction) const;

  // Sixteen rays from one origin that point to nearly the same place; NaN directions miss.
  static constexpr int kPacket = 16;
  struct Packet {
    std::array<Eigen::Vector3f, kPacket> direction;
    std::array<float, kPacket> time;  // 0 the shutter opens, 1 it closes
  };
  void CastPacket(const Eigen::Vector3f& origin_mm, const Packet& packet,
                  std::array<RayHit, kPacket>* hits) const;

  // True if anything lies on the ray between `near_mm` and `far_mm`; `direction` has length 1.
  bool Occluded(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction, float near_mm,
                float far_mm) const;

  // True if nothing lies between the two points, the last `clearance_mm` before `to_mm` apart.
  bool InSight(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, double clearance_mm) const;

 private:
  struct Handles;
  std::shared_ptr<const Handles> handles_;
};

}  // namespace weft
