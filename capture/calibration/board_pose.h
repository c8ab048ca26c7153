// The pose of a flat board from one image.
#pragma once

#include <vector>

#include "capture/calibration/calibration_bundle.h"

namespace weft {

// camera_from_board and what is left of the corners, root mean square over coordinates.
struct BoardPoseGuess {
  RigidPose camera_from_board;
  double rms_px = 0;
};

// The poses under which a flat board gives these pixels, best first: two at most, since a board seen small or
// from afar looks nearly the same turned the other way (Collins and Bartoli, Infinitesimal Plane-Based Pose
// Estimation, IJCV 2014). Empty for fewer than 4 corners, corners on a line, or pixels that the lens cannot
// give.
std::vector<BoardPoseGuess> GuessBoardPose(const TagBoard& board, const std::vector<BoardCorner>& corners,
                                           const CameraModel& camera);

}  // namespace weft
