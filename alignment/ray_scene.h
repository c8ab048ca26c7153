// Ray casts against one triangle mesh (Embree).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
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

// A mesh prepared for ray casts. Immutable; any number of threads may cast at once.
class RayScene {
 public:
  // InvalidArgument: face indices out of range, or vertices not finite. Internal: Embree's own message.
  static absl::StatusOr<RayScene> Build(const std::vector<Eigen::Vector3d>& vertices_mm,
                                        const std::vector<Face>& faces);

  RayHit Cast(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction) const;

  // True if anything lies on the ray between `near_mm` and `far_mm`; `direction` has length 1.
  bool Occluded(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction, float near_mm,
                float far_mm) const;

  // The same for up to sixteen rays at once, which is faster the more alike they are: bit k is set if
  // anything lies on ray k.
  static constexpr int kPacket = 16;
  struct Packet {
    int count = 0;
    std::array<Eigen::Vector3f, kPacket> origin_mm, direction;
    std::array<float, kPacket> near_mm, far_mm;

    void Add(const Eigen::Vector3f& from_mm, const Eigen::Vector3f& along, float near, float far) {
      origin_mm[count] = from_mm, direction[count] = along;
      near_mm[count] = near, far_mm[count] = far;
      ++count;
    }
  };
  uint32_t Occluded(const Packet& packet) const;

  // True if nothing lies between the two points, the last `clearance_mm` before `to_mm` apart.
  bool InSight(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, double clearance_mm) const;

 private:
  struct Handles;
  std::shared_ptr<const Handles> handles_;
};

}  // namespace weft
