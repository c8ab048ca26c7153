// A first idea of a camera's lens from nothing but the boards that it saw.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/calibration_bundle.h"

namespace weft {

// Tries 40 focal lengths from 0.3 to 15 times the longer side of the image against the poses of planar
// boards (GuessBoardPose). Then adjusts focal lengths, principal point and k1 over at most 30 views.
// Principal points may be far from the image's centre. The camera stands at the world's origin.
// FailedPrecondition: fewer than 3 views, or boards whose poses say nothing of the focal length; the
// message names the camera and the remedy. Corners must be of 8 or more per view.
absl::StatusOr<CameraModel> GuessCamera(const std::vector<TagBoard>& boards, const CalibrationCamera& camera,
                                        const std::vector<const BoardView*>& views);

}  // namespace weft
