// A frame set from the views of a recording: the part of reading that every kind of recording shares.
#pragma once

#include <cstddef>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"

namespace weft {

// Frame `index` of the source by ReadView, in the order of the rig's cameras; a view that cannot be read is
// listed in `missing` with its reason. OutOfRange: no such frame.
absl::StatusOr<FrameSet> ReadFrameSet(const FrameSource& source, const Rig& rig, size_t index);

}  // namespace weft
