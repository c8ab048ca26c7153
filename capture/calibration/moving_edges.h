// How sharp what moves before a camera is, where no tag can be read.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// Standard deviation of the edges of moving objects (median, px; too low where edges lie closer than they
// are wide). Moving pixels differ by `min_contrast` grey values from the median of all images, so a sharp
// background does not hide a blurred board. Empty where too little moves to tell. InvalidArgument: fewer
// than 3 images, invalid ones, or of different sizes.
absl::StatusOr<std::optional<double>> MovingEdgeBlurPx(const std::vector<Frame>& images,
                                                       double min_contrast = 20);

}  // namespace weft
