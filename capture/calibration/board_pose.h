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

// The poses of a planar board that project to these pixels, best first. There are at most two, since a
// small or distant board looks nearly the same in its mirrored pose (Collins and Bartoli, Infinitesimal
// Plane-Based Pose Estimation, IJCV 2014). Empty for fewer than 4 corners, corners on a line, or pixels
// that the lens cannot give.
std::vector<BoardPoseGuess> GuessBoardPose(const TagBoard& board, const std::vector<BoardCorner>& corners,
                                           const CameraModel& camera);

}  // namespace weft
