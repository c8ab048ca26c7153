// The light of the studio and what of it reaches the surfaces in it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "alignment/ray_scene.h"

namespace weft {

// A dome of light all around, brighter from above (-y), with soft lamps in it.
struct Lamp {
  Eigen::Vector3f direction = Eigen::Vector3f(0, -1, 0);  // towards the lamp, any length
  float half_angle_deg = 20;
  float radiance = 4;  // relative to the dome
};
struct LightOptions {
  float dome_radiance = 0.45f;
  float dome_gradient = 0.25f;  // added straight up, subtracted straight down
  std::vector<Lamp> lamps = {
      {{0.9f, -0.7f, -0.6f}, 20, 8}, {{-0.9f, -0.5f, -0.4f}, 20, 6}, {{0.1f, -0.6f, 1.0f}, 20, 7}};
  float bounce = 0.12f;  // light that reaches a place by way of the cloth that hides the dome
  int rays = 96;  // per vertex of the cloth, on its outer side; a third of that inside, half on the body

  absl::Status Validate() const;
};

// Light from a direction of length 1.
float DomeRadiance(const LightOptions& options, const Eigen::Vector3f& direction);

// Irradiance of each vertex on its outer and its inner side, relative to an unoccluded white dome. `flux`
// is the derivative of the outer one by the normal: d outside = flux . d normal. The first
// `cloth_vertices` are the cloth's; the others are a closed body's, which has no light inside. Ray casts
// from every vertex in the calling thread's TBB arena; shadows are soft, at the mesh's resolution.
struct VertexLight {
  std::vector<float> outside, inside;  // [vertices]
  std::vector<Eigen::Vector3f> flux;   // [vertices]
};
VertexLight LightVertices(const RayScene& scene, const std::vector<Eigen::Vector3d>& vertices_mm,
                          const std::vector<Eigen::Vector3d>& normals, size_t cloth_vertices,
                          const LightOptions& options);

}  // namespace weft
