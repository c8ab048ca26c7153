// Bundle adjustment of cameras, board placements and board warps.
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "capture/calibration/calibration_bundle.h"

namespace weft {

// Which of a lens's numbers may change; each kind includes those before it.
enum class LensFreedom { kNone, kFocalLength, kCenterAndK1, kAll };

struct BundleOptions {
  LensFreedom lens = LensFreedom::kAll;
  bool free_cameras = true;  // their poses; the reference camera's pose never changes
  bool free_warps = true;
  int reference_camera = 0;  // what the other poses are found relative to
  double huber_sigmas = 3;   // residuals beyond this count linearly
  int max_iterations = 50;
  double tolerance = 1e-8;    // relative change of the cost at which it ends
  double first_radius = 1e4;  // of the trust region, in Ceres' units; larger where the start is good

  absl::Status Validate() const;
};

struct BundleSummary {
  bool converged = false;
  int iterations = 0;
  double initial_cost = 0;  // half of the sum of Huber's loss, residuals in sigmas
  double final_cost = 0;
};

// Least squares by Levenberg and Marquardt (Ceres), placements eliminated by the Schur complement. All
// corners of a view go in as one block of 21 equations (ViewSums): the same problem, smaller by the number of
// corners. RadialPriorWeights holds the lenses where boards did not reach. Metric scale comes from the
// boards' sizes. `on_iteration` (may be empty) receives the iterations done and their maximum. Internal:
// the solver failed, its words included. Parallel in the calling thread's TBB arena, the same bytes at any
// thread count.
absl::StatusOr<BundleSummary> AdjustBundle(const BundleOptions& options, CalibrationBundle* bundle,
                                           const std::function<void(int, int)>& on_iteration = {});

}  // namespace weft
