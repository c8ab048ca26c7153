// Lossless compression of frames: the image's planes apart, each byte predicted from its neighbours, zstd
// over the rest. Planes are the bytes of one colour of a mosaic, one channel, one half of a 16-bit word.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "capture/image/aligned_buffer.h"
#include "capture/image/raw_frame.h"

namespace weft {

// The frame's bytes, packed. Precondition: the frame is valid. May be larger than the frame where it is
// noise.
absl::StatusOr<std::unique_ptr<AlignedBuffer>> EncodeFrame(const RawFrame& frame, int zstd_level);

// The `frame_bytes` bytes that were packed. DataLoss: `packed` is no such thing.
absl::StatusOr<std::unique_ptr<AlignedBuffer>> DecodeFrameBytes(const AlignedBuffer& packed, RawFormat format,
                                                                int width_px, uint64_t frame_bytes);

}  // namespace weft
