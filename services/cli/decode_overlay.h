// A picture that shows what decoding made of an image.
#pragma once

#include "absl/status/statusor.h"
#include "capture/frame.h"
#include "pattern/decoder.h"

namespace weft {

// The image (enlarged where its cells are small), with a dot per cell from red (unsure) over yellow to green
// (sure), a white point per corner, and a box with the reason around every rejected patch. Large patches come
// first where boxes would cover each other. InvalidArgument: the frame is no image.
absl::StatusOr<Frame> DrawDecoding(const Frame& frame, const DecodeResult& result);

}  // namespace weft
