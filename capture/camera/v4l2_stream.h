// The buffers between a V4L2 driver and us.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/camera/v4l2_device.h"
#include "capture/image/aligned_buffer.h"

namespace weft {

enum class V4l2Memory {
  kMmap,  // the driver's, copied out of
  kUser,  // ours: a frame that fills its buffer goes on without a copy
};

// A buffer that the driver has filled.
struct V4l2Filled {
  std::shared_ptr<AlignedBuffer> bytes;  // lines without padding; none where the image is not whole
  std::string fault;                     // in words, where it is not
  int64_t monotonic_ns = 0;              // CLOCK_MONOTONIC as the driver says, or when we took it
  uint32_t sequence = 0;
};

// A running stream. The device outlives it. Thread safety: none.
class V4l2Stream {
 public:
  // InvalidArgument: the driver has no such buffers. Unavailable: it does not start.
  static absl::StatusOr<std::unique_ptr<V4l2Stream>> Start(const V4l2Device& device, const V4l2Image& image,
                                                           V4l2Memory memory, int buffers);
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  // DeadlineExceeded: none is filled. Unavailable: the stream is broken, or the device is gone.
  absl::StatusOr<V4l2Filled> Next();

  // The driver says when a frame was taken; otherwise times are those at which we took its buffer.
  bool has_times() const { return has_times_; }
  // Times are of the start of the exposure, not of the end of the transfer.
  bool has_exposure_times() const { return has_exposure_times_; }
  int buffers() const { return static_cast<int>(buffers_.size()); }

 private:
  struct Buffer {
    uint8_t* mapped = nullptr;
    size_t mapped_bytes = 0;
    std::shared_ptr<AlignedBuffer> own;
  };

  V4l2Stream(int fd, const V4l2Image& image, V4l2Memory memory);
  absl::Status Map();
  absl::Status Queue(uint32_t index);
  std::string FaultOf(uint32_t flags, uint64_t used, const uint8_t* data) const;
  std::shared_ptr<AlignedBuffer> Content(Buffer& buffer, uint64_t used);

  const int fd_;
  const V4l2Image image_;
  const V4l2Memory memory_;
  std::vector<Buffer> buffers_;
  BufferPool filled_, images_;  // as large as the driver's buffers; as large as an image without padding
  bool has_times_ = false, has_exposure_times_ = false;
  absl::Status queueing_;  // of the last buffer that was given back
};

// The bytes of a JPEG up to its end marker, zeros behind it left out; 0 where it has no beginning or no end.
uint64_t WholeJpegBytes(const uint8_t* data, uint64_t size);

// Copies an image whose lines are `from_line_bytes` apart to one whose lines follow each other.
void CopyLines(const uint8_t* from, uint64_t from_line_bytes, int lines, uint64_t line_bytes, uint8_t* to);

}  // namespace weft
