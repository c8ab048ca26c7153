// What printed cloth looks like: inks, fabric, light.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "pattern/board.h"
#include "simulation/ray_scene.h"

namespace weft {

// Linear reflectances in red, green, blue. The defaults are what photographs of worn printed jersey show once
// their blur is undone: dark, unsaturated, blue and magenta darkest, white bluish, lines barely darker than
// blue.
struct InkOptions {
  std::array<Eigen::Vector3f, kCellColors> color = {{{0.176f, 0.024f, 0.016f},
                                                     {0.108f, 0.201f, 0.103f},
                                                     {0.284f, 0.340f, 0.112f},
                                                     {0.009f, 0.015f, 0.135f},
                                                     {0.122f, 0.054f, 0.158f},
                                                     {0.130f, 0.240f, 0.368f},
                                                     {0.305f, 0.375f, 0.478f}}};
  Eigen::Vector3f line = {0.007f, 0.005f, 0.011f};
  Eigen::Vector3f back = {0.30f, 0.31f, 0.34f};  // the fabric's unprinted inside
  double spread_cells = 0.05;                    // width over which square and line mix
  double corner_cells = 0.06;                    // radius of the squares' corners
  double cell_variation = 0.06;                  // standard deviation of a cell's reflectance, relative
  double weave_variation = 0.05;                 // the same for places a sixth of a cell in size
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Reflectance of the printed side at a board position (in cells). Outside the board: `line`.
Eigen::Vector3f InkAt(const Board& board, const InkOptions& inks, float col, float row);

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
  int rays = 96;         // per vertex and side

  absl::Status Validate() const;
};

// Light falling on each vertex from its outer and its inner side, relative to an unoccluded white dome.
// Ray casts from every vertex in the calling thread's TBB arena; shadows are soft, at the mesh's resolution.
struct VertexLight {
  std::vector<float> outside, inside;  // [vertices]
};
VertexLight LightVertices(const RayScene& scene, const std::vector<Eigen::Vector3d>& vertices_mm,
                          const std::vector<Eigen::Vector3d>& normals, const LightOptions& options);

}  // namespace weft
