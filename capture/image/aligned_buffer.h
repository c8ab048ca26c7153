// Memory that a disk takes without a copy, and a pool of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace weft {

// What files opened with O_DIRECT ask of addresses, offsets and lengths.
inline constexpr size_t kBlockBytes = 4096;

// `bytes` rounded up to whole blocks.
constexpr uint64_t PaddedBytes(uint64_t bytes) {
  return (bytes + kBlockBytes - 1) / kBlockBytes * kBlockBytes;
}

// Bytes that start at a block and end with a block whose rest is zero. The content is undefined at first.
class AlignedBuffer {
 public:
  explicit AlignedBuffer(size_t size);
  ~AlignedBuffer();
  AlignedBuffer(const AlignedBuffer&) = delete;
  AlignedBuffer& operator=(const AlignedBuffer&) = delete;

  uint8_t* data() { return data_; }
  const uint8_t* data() const { return data_; }
  size_t size() const { return size_; }
  // Shortens the content; the padding stays zero. Precondition: size <= size().
  void Shrink(size_t size);

 private:
  uint8_t* data_ = nullptr;
  size_t size_ = 0;
};

// Hands out buffers of one size and takes them back when the last user lets go, since fresh pages cost as
// much as the copy into them. Holds at most `max_spare` unused ones. Thread safety: any thread may call;
// buffers may outlive the pool.
class BufferPool {
 public:
  BufferPool(size_t buffer_bytes, size_t max_spare);
  std::shared_ptr<AlignedBuffer> Take();

 private:
  struct Spare;
  const size_t buffer_bytes_;
  std::shared_ptr<Spare> spare_;
};

}  // namespace weft
