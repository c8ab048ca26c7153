// Images that were taken a little before or after the moment of their frame.
#pragma once

#include <cstddef>
#include <optional>

#include "capture/take/frame_source.h"

namespace weft {

// Times against the frame's moment, of opposite sign: of the camera's image of this frame, and of its image
// of the frame `other`, the one before or after.
struct ViewMoment {
  double own_s = 0, other_s = 0;
  size_t other = 0;
};

// Nothing where the image was taken at the frame's moment, to 2/1000 of the time between images, where times
// do not compare, or where the image on the other side is missing.
std::optional<ViewMoment> MomentOfView(const FrameSource& dump, size_t index, size_t camera);

}  // namespace weft
