// A rig around a cloth: cameras on rings, as different from each other as real ones.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

struct StudioRigOptions {
  int cameras = 10;
  int width_px = 960;
  int height_px = 1280;
  double distance_mm = 1400;            // camera centre to aim point; each camera varies by up to 10 %
  double around_deg = 360;              // arc that the cameras cover, centred on -z; 360 for the full circle
  double around_variation_deg = 2;      // each camera stands off its place by up to this, each way,
  double elevation_variation_deg = 3;   // and looks from higher or lower
  double elevation_deg = 22;            // even cameras look down from above, odd ones up from below
  double object_width_mm = 200;         // what must stay in the picture, seen from the side ...
  double object_height_mm = 300;        // ... and its height
  double fill = 0.80;                   // share of the picture that the object fills with the shortest lens
  double focal_spread = 0.15;           // focal lengths are longer by up to this share
  double principal_point_shift = 0.04;  // of the picture's size, each way
  double distortion = 0.10;             // size of k1; k2, p1, p2 in proportion
  Eigen::Vector3d aim_mm = Eigen::Vector3d::Zero();
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Cameras c00, c01, ... in the world axes of the cloth (x right, y down). The same seed gives the same rig.
absl::StatusOr<Rig> MakeStudioRig(const std::string& id, const StudioRigOptions& options);

// Where the cameras of a rig look: the point nearest to the rays through the middles of their pictures, in
// the sense of least squares. For a single camera, and cameras that look along one line, the point of the
// line nearest to the origin.
Eigen::Vector3d AimOf(const Rig& rig);

// Crops each image to the box, which shifts only the principal points. Cameras that show less than 64 px
// of the box in width or height are left out. InvalidArgument when none is left.
absl::StatusOr<Rig> CropRig(const Rig& rig, const Eigen::AlignedBox3d& box_mm);

}  // namespace weft
