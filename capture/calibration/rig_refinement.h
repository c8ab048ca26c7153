// A rig corrected by points that its cameras saw together, such as the cells of a printed cloth over a take.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

// A point in one image.
struct PointSight {
  int camera = 0;  // of the rig
  int point = 0;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  // per axis
};

struct RigRefinementOptions {
  // How far a camera may be off by itself. Points that are not known tell nothing of where the rig stands in
  // the world and how large it is: cameras that stay within these keep both. One beyond them has moved, and
  // loses its say.
  double still_rotation_deg = 0.01;
  double still_center_mm = 0.2;
  double huber_sigmas = 3;      // residuals beyond this count linearly
  double max_residual_px = 20;  // sights further from the given point in the given rig are taken for wrong
  int min_sights = 200;         // cameras with fewer stay as they are
  double moved_px = 0.25;       // cameras whose sights shift by more (root mean square) have moved
  // A camera whose median residual is this many times that of most cameras, both over their sigmas, and this
  // long, fits no pose. Its images are late or still, or its lens is another. `accuracy_refinement`
  // shows what right and late cameras have.
  double misfit_ratio = 3;
  double misfit_px = 0.2;
  int max_iterations = 50;

  absl::Status Validate() const;
};

struct CameraCorrection {
  int sights = 0;     // used; of a camera that was held, found
  bool held = false;  // min_sights, or misfit
  bool misfit = false;
  bool moved = false;
  double rotation_deg = 0;  // of the new camera against the old, and how well it is known
  double rotation_sigma_deg = 0;
  double center_mm = 0;
  double center_sigma_mm = 0;
  double shift_px = 0;       // of its sights from the old to the new camera, root mean square
  double before_rms_px = 0;  // residuals against the given points in the old rig
  double after_rms_px = 0;   // against the adjusted points in the new one
  // Lengths of the residuals after, of misfits at their best pose.
  double after_median_px = 0;
  double after_median_sigmas = 0;
  // Of a turn about the camera's axes (rad) and of its centre along the world's (mm), all other unknowns
  // free.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

struct RefinedRig {
  std::vector<CameraModel> cameras;
  std::vector<CameraCorrection> corrections;  // [cameras]
  std::vector<Eigen::Vector3d> points_mm;     // adjusted
  bool converged = false;
};

// Bundle adjustment of camera poses and points (Ceres, points eliminated); lenses stay as they were
// calibrated. Cameras that fit no pose are left out and stay as they were; where they are more than a
// quarter, nothing tells who is wrong, and none is left out. `points_mm` are where the given rig sees them.
// InvalidArgument: options, indices, numbers.
// FailedPrecondition: fewer than three cameras have enough sights, or the solver failed.
absl::StatusOr<RefinedRig> RefineRig(const Rig& rig, const std::vector<Eigen::Vector3d>& points_mm,
                                     const std::vector<PointSight>& sights,
                                     const RigRefinementOptions& options);

}  // namespace weft
