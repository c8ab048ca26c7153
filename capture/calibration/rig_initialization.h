// First poses of all cameras and boards, found from camera to camera without a view that all share.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/calibration_bundle.h"

namespace weft {

// Cameras with lenses (GuessCamera, or an earlier rig) and views; fills in the poses of cameras and
// placements. Each common board gives an estimate of the relative pose of two cameras, or two where its
// pose is ambiguous. The one that most others confirm is taken. Cameras are linked by the maximum spanning
// tree over the confirmed boards. A placement takes the estimate of the camera that leaves the smallest
// residuals in all. Cameras with large residuals are estimated again from the boards on which the others
// agree. FailedPrecondition names disconnected cameras. Parallel in the calling thread's TBB arena.
absl::Status InitializePoses(CalibrationBundle* bundle);

}  // namespace weft
