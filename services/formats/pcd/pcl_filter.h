// Outliers of scans, found by PCL. Only the program weft-pcl links it.
#pragma once

#include "absl/status/statusor.h"
#include "services/formats/files/ply.h"

namespace weft {

// Least errors of hidden cloth by benchmark_scan_filter (a wrinkled sheet with 10 and 30 % outliers,
// 2026-11-23) of those by which no good point is lost.
struct OutlierOptions {
  int neighbors = 6;
  double most_sigmas = 0.5;
};

// Without the vertices whose mean distance to their nearest `neighbors` is more than `most_sigmas` standard
// deviations above that of all (pcl::StatisticalOutlierRemoval). Properties of the others stay. `ply` has an
// element "vertex" alone left. InvalidArgument: no element "vertex" with x y z. Exceptions of PCL pass.
absl::StatusOr<Ply> WithoutOutliers(Ply ply, const OutlierOptions& options);

}  // namespace weft
