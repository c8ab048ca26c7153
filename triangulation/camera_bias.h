// Whether a camera sees the cloth where the others say that it is.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "triangulation/triangulate.h"

namespace weft {

// Residuals of one camera, observed minus expected, where the expected pixel is that of the point as all
// other cameras see it.
struct CameraBias {
  int observations = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_sigma_px = Eigen::Vector2d::Zero();  // of the mean; 0 where there are too few blocks
  double rms_px = 0;
  // Length of the mean in units of its sigma; above 4 it is hardly chance. Decoding itself leaves up to 0.07
  // px in views of perfectly known cameras; a longer mean says that the camera moved or its calibration is
  // off. 0 where mean_sigma_px is.
  double significance = 0;
};

// One entry per camera of the rig; `options` are those that the cloud was made with. Points need one camera
// more than min_views to count for those that make them up. InvalidArgument: options; a view of a camera that
// the rig lacks.
absl::StatusOr<std::vector<CameraBias>> MeasureCameraBias(const Rig& rig,
                                                          const std::vector<ViewObservations>& views,
                                                          const Cloud& cloud,
                                                          const TriangulationOptions& options);

}  // namespace weft
