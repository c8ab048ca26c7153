// A picture that shows what decoding made of an image.
#pragma once

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "pattern/decoder.h"

namespace weft {

// The image (enlarged where its cells are small) with what became of it, and a legend with counts below: a
// dot per cell in the colour of the patch that it grew from, a white point per corner, grey points for spots
// that belong to no patch, a cross where growth stopped in the colour of the reason, and a box around every
// rejected patch with its reason and size in words, as far as there is room. `result` was decoded with
// DecodeOptions::explain. InvalidArgument: the frame is no image.
absl::StatusOr<Frame> DrawDecoding(const Frame& frame, const DecodeResult& result);

}  // namespace weft
