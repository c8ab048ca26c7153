// Calibration boards moved through the volume that a rig sees, and what its cameras see of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/board_view.h"
#include "capture/calibration/calibration_bundle.h"
#include "capture/calibration/target.h"
#include "capture/rig/rig.h"

namespace weft {

struct BoardMotionOptions {
  int frames = 60;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d reach_mm = {100, 150, 100};  // half of the volume that the boards' middles stay in
  double tilt_deg = 40;   // from facing a camera, each camera in its turn; up to this in any direction
  double bend_mm = 0.5;   // standard deviation of the boards' bends
  double stretch = 3e-4;  // and of their stretch
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Boards and scale bars in motion.
struct MovedTarget {
  CalibrationTarget target;
  std::vector<BoardWarp> warps;            // [boards]
  std::vector<BoardPlacement> placements;  // every board in every frame
  // [frames * bars] the bar's middle, x along it, z away from who sees its tags.
  std::vector<RigidPose> world_from_bar;
};
absl::StatusOr<MovedTarget> MoveTarget(const CalibrationTarget& target, const Rig& rig,
                                       const BoardMotionOptions& options);

// Exact pixels with normal noise, of boards whose printed side faces the camera within `max_facing_deg`;
// corners outside of the picture are left out, and tags of which a corner is. Boards do not hide each other.
struct BoardSightOptions {
  double noise_px = 0.1;
  double max_facing_deg = 65;
  uint64_t seed = 1;
};
CalibrationViews SeeTarget(const MovedTarget& moved, const Rig& rig, const BoardSightOptions& options);

}  // namespace weft
