// How sharp what moves before a camera is, where no tag can be read.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// Standard deviation of the edges (median, px; low where they lie closer than they are wide) in what moves:
// pixels that differ by `min_contrast` grey values from the median of all images. So a board that is carried
// blurred before a sharp room is blurred. Empty where too little moves to tell. InvalidArgument: fewer than 3
// images, invalid ones, or of different sizes.
absl::StatusOr<std::optional<double>> MovingEdgeBlurPx(const std::vector<Frame>& images,
                                                       double min_contrast = 20);

}  // namespace weft
