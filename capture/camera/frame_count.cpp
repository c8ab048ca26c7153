#include "capture/camera/frame_count.h"

#include <algorithm>

namespace weft {

uint64_t BlockIdUnwrapper::Unwrap(uint64_t block_id) {
  constexpr uint64_t kIds = 65535;
  if (block_id == 0 || block_id > kIds || last_ == 0) {
    last_ = std::max(last_, block_id);
    return block_id == 0 ? last_ : last_ = block_id;
  }
  const uint64_t step = (block_id + kIds - ((last_ - 1) % kIds + 1)) % kIds;
  return last_ += step <= kIds / 2 ? step : 0;
}

uint64_t SequenceUnwrapper::Unwrap(uint32_t sequence) {
  last_ = last_ ? *last_ + static_cast<uint32_t>(sequence - static_cast<uint32_t>(*last_)) : sequence;
  return *last_;
}

}  // namespace weft
