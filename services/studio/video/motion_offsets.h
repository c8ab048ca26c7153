// By how much the times of videos differ, from the motion of the board's cells that they show.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/rig/rig.h"
#include "pattern/board/board.h"
#include "weft/v1/video.pb.h"

namespace weft {

struct MotionOffsetOptions {
  double max_offset_s = 0.75;  // between two cameras, beyond what timecode says
  double window_s = 2;         // of film that is decoded at once; more than max_offset_s
  std::optional<PixelFormat> mosaic;
};

// Decodes a window in the middle of what the videos show together, and others where it does not tell enough.
// Where all videos have timecode, it is where the search begins, else the clips' first frames. Every video is
// of a camera of the rig. `progress`: pictures decoded, of how many; false
// stops (Cancelled). FailedPrecondition: the cloth stands
// still, or a camera shares too few cells with the others; it is named, with the remedy.
absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByMotion(
    const Rig& rig, const Board& board, const std::vector<v1::VideoFacts>& videos,
    const MotionOffsetOptions& options, const std::function<bool(uint64_t done, uint64_t total)>& progress);

}  // namespace weft
