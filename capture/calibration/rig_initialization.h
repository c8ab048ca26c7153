// First poses of all cameras and boards, found from camera to camera without a view that all share.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/calibration_bundle.h"

namespace weft {

// Cameras with lenses (GuessCamera, or an earlier rig) and views; fills in the poses of cameras and
// placements. Two cameras that see the same boards give as many estimates of their relative pose, two per
// board where its pose is ambiguous; the one that most of the others confirm counts. Cameras are linked by
// the maximum spanning tree over the confirmed boards, each placement stands where the estimate of one of its
// cameras leaves the smallest residuals in all, and cameras that fit badly are set again by the boards that
// the others agree on. FailedPrecondition: cameras that nothing links, named. Parallel in the calling
// thread's TBB arena.
absl::Status InitializePoses(CalibrationBundle* bundle);

}  // namespace weft
