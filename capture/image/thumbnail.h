// Small pictures to look at.
#pragma once

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// RGB; each pixel is the mean of those that fall on it. InvalidArgument: sizes that are not positive, an
// invalid frame.
absl::StatusOr<Frame> Resized(const Frame& frame, int width_px, int height_px);
// As high as its shape wants; frames that are narrower stay as large as they are.
absl::StatusOr<Frame> Thumbnail(const Frame& frame, int width_px);

}  // namespace weft
