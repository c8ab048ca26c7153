// Cloth in motion: a physically based simulation of a sheet or tube that is held at its borders.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "simulation/cloth.h"

namespace weft {

// Cotton jersey by default.
struct FabricOptions {
  double density_kg_m2 = 0.3;
  double bending_n_m = 8e-6;     // bending stiffness per width
  double shear_n_per_m = 20;     // resistance of the grid against becoming a parallelogram
  double air_drag_per_s = 3;     // share of the velocity lost per second
  double thickness_cells = 0.8;  // nearest approach of two layers of vertices, in cells
};

struct MotionOptions {
  int frames = 5;
  double fps = 30;
  double period_s = 2;          // of the handles' motion
  double settle_s = 0.7;        // time from rest to the first frame
  double compression = 0.10;    // share by which the handles come closer; this is what makes folds
  double twist_deg = 30;        // of the tube's lower end against the upper one, each way
  double sway_mm = 8;           // sideways motion of the handles, each way
  double gravity_mm_s2 = 9810;  // along +y
  double step_s = 1.0 / 5000;   // of the integration
  FabricOptions fabric;
  uint64_t seed = 1;  // phases, pleats and the small disturbance from which folds grow

  absl::Status Validate() const;
};

// Vertex positions [frames][vertices] in mm. Extended position-based dynamics with small steps (Macklin et
// al. 2016 and 2019): inextensible edges, shear, quadratic bending, contact between layers by vertex distance
// (layers of vertices cannot pass through each other while they stay `thickness_cells` apart), a body inside
// the tube. Deterministic: single-threaded, the same bytes for the same options. `on_frame` (may be empty) is
// called with the number of frames done. Internal when the simulation diverges, with the remedy.
absl::StatusOr<std::vector<std::vector<Eigen::Vector3d>>> SimulateMotion(
    const Cloth& cloth, const MotionOptions& options, const std::function<void(int)>& on_frame = {});

}  // namespace weft
