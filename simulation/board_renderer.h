// Pictures of calibration boards, as a rig's cameras would take them.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"
#include "simulation/board_motion.h"
#include "simulation/lens.h"
#include "simulation/sensor.h"

namespace weft {

struct BoardLookOptions {
  double margin_mm = 12;                           // of white around the outer tags
  double black = 0.04, white = 0.75, room = 0.25;  // linear light
  double shading = 0.25;     // how much darker a board is at 60 degrees from the light than at 0
  int samples = 4;           // per pixel and axis
  double bar_tag_mm = 30;    // size of the tags at the ends of scale bars, which face the camera
  double blur_along_px = 0;  // motion blur: length of the way of every point during the exposure
  LensOptions lens;          // point spread and vignetting; boards are in focus
  SensorOptions sensor = {.readout = Readout::kBinned, .exposure = 1.2, .gamma = 1};

  absl::Status Validate() const;
};

// What the camera sees in one frame: boards with their warps, nearer ones before others, in front of a plain
// room. Every pixel is the mean over its area through the full lens model. Boards that show their back are
// white. Parallel over rows in the calling thread's TBB arena, the same bytes at any thread count. Grey, 8
// bits.
absl::StatusOr<Frame> RenderBoards(const MovedTarget& moved, int frame, const CameraModel& camera,
                                   const BoardLookOptions& options);

}  // namespace weft
