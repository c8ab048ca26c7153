// RANSAC triangulation of board nodes seen by several cameras (paper, section 5.2).
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/rig.h"
#include "pattern/observation.h"
#include "triangulation/cloud.h"

namespace weft {

// The decoded nodes of one view.
struct ViewObservations {
  int camera = 0;  // index into Rig::cameras
  std::vector<Observation> observations;
};

struct TriangulationOptions {
  double inlier_radius_mm = 1.0;  // distance of a ray from the point
  int min_views = 3;              // inlier rays from distinct cameras
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// One point per node that enough cameras agree on, every other seen node in `rejected` with its reason. Runs
// parallel loops in the calling thread's TBB arena; the same result at any thread count.
absl::StatusOr<Cloud> Triangulate(const Rig& rig, const std::vector<ViewObservations>& views,
                                  const TriangulationOptions& options);

}  // namespace weft
