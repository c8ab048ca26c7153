// Outliers of scans, found by PCL. Only the program weft-pcl links it.
#pragma once

#include "absl/status/statusor.h"
#include "services/files/ply.h"

namespace weft {

// Without the vertices whose mean distance to their 12 nearest ones is more than a standard deviation above
// that of all (pcl::StatisticalOutlierRemoval); their properties stay. `ply` has an element "vertex" alone
// left. InvalidArgument: no element "vertex" with x y z. Exceptions of PCL pass.
absl::StatusOr<Ply> WithoutOutliers(Ply ply);

}  // namespace weft
