// A picture that shows what decoding made of an image.
#pragma once

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "pattern/decoder.h"

namespace weft {

// The image (enlarged where its cells are small) with the decoding drawn over it, and a legend with counts
// below. A cell is a dot in the colour of the patch that it grew from, a corner a white point. Grey points
// are blobs of no patch. A cross in the colour of the reason marks where growth stopped. A box with reason
// and size surrounds every rejected patch, as far as there is room. `result` was decoded with
// DecodeOptions::explain. InvalidArgument: the frame is no image.
absl::StatusOr<Frame> DrawDecoding(const Frame& frame, const DecodeResult& result);

}  // namespace weft
