// How well each camera agrees with the others.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "evaluation/error_tally.h"
#include "triangulation/cloud.h"
#include "triangulation/triangulate.h"

namespace weft {

struct CameraErrorOptions {
  int max_nodes = 5000;   // of a frame's cloud that are looked at, spread evenly
  double sigma_px = 0.2;  // of observations that do not tell theirs
  TriangulationOptions triangulation;

  absl::Status Validate() const;
};

// Residuals of one camera over the nodes of a frame.
struct CameraErrors {
  std::string camera_id;
  int64_t observations = 0;    // of nodes that have a point
  int64_t outliers = 0;        // of them, those that the point does not agree with
  ErrorTally reprojection_px;  // of the others: distance to the projected point
  // The same where the point is triangulated anew from all other cameras that agree with it; of points that
  // keep enough views. Unlike the reprojection error it cannot hide in the point.
  ErrorTally left_out_px;
  Eigen::Vector2d shift_sum_px =
      Eigen::Vector2d::Zero();  // of the left-out residuals, projected minus observed

  CameraErrors& operator+=(const CameraErrors& other);
};

// One entry per camera of the rig. InvalidArgument: options, a view of a camera that the rig lacks. Parallel
// in the calling thread's TBB arena; the same numbers at any thread count.
absl::StatusOr<std::vector<CameraErrors>> MeasureCameraErrors(const Rig& rig,
                                                              std::vector<ViewObservations> views,
                                                              const Cloud& cloud,
                                                              const CameraErrorOptions& options);

}  // namespace weft
