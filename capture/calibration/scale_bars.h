// Lengths of scale bars in a calibrated rig.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/solve_calibration.h"

namespace weft {

// Both ends triangulated in every frame in which two cameras or more saw them; bars that were never seen so
// are left out.
std::vector<ScaleBarFit> MeasureScaleBars(const CalibrationTarget& target, const CalibrationViews& views,
                                          const std::vector<CameraModel>& cameras);

// True length over measured length, bars weighted by their sigmas. FailedPrecondition: no bar was measured.
absl::StatusOr<double> ScaleFromBars(const CalibrationTarget& target, const std::vector<ScaleBarFit>& bars);

}  // namespace weft
