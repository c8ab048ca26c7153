// What keeps a frame set from being recorded.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/image/raw_frame.h"

namespace weft {

// Why a set cannot be recorded as it is: a number that is not after `last`, a camera that it does not account
// for once, a frame that is none. Empty where it can.
std::string FaultOfSet(const RawFrameSet& set, const std::vector<std::string>& camera_ids,
                       const std::optional<uint64_t>& last);

}  // namespace weft
