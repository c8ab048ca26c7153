// Cameras' counts of their frames, which wrap.
#pragma once

#include <cstdint>
#include <optional>

namespace weft {

// The block ids of GigE Vision count from 1 to 65535 and then from 1 again, or on in 64 bits.
class BlockIdUnwrapper {
 public:
  // The id as it would be without wrapping. Blocks come in order, up to 32767 of them may be missing.
  uint64_t Unwrap(uint64_t block_id);
  void Reset() { last_ = 0; }

 private:
  uint64_t last_ = 0;
};

// The count of frames of V4L2, which has 32 bits, without wrapping. Frames come in order.
class SequenceUnwrapper {
 public:
  uint64_t Unwrap(uint32_t sequence);
  void Reset() { last_.reset(); }

 private:
  std::optional<uint64_t> last_;
};

}  // namespace weft
