#include "capture/image/aligned_buffer.h"

#include <cstring>
#include <new>
#include <utility>
#include <vector>

#include "base/mutex.h"

namespace weft {

AlignedBuffer::AlignedBuffer(size_t size) : size_(size) {
  const size_t padded = PaddedBytes(size > 0 ? size : 1);
  data_ = static_cast<uint8_t*>(::operator new (padded, std::align_val_t{kBlockBytes}));
  std::memset(data_ + size, 0, padded - size);
}

AlignedBuffer::~AlignedBuffer() { ::operator delete (data_, std::align_val_t{kBlockBytes}); }

void AlignedBuffer::Shrink(size_t size) {
  std::memset(data_ + size, 0, PaddedBytes(size) - size);
  size_ = size;
}

struct BufferPool::Spare {
  Mutex mutex;
  size_t limit = 0;
  std::vector<std::unique_ptr<AlignedBuffer>> buffers ABSL_GUARDED_BY(mutex);
};

BufferPool::BufferPool(size_t buffer_bytes, size_t max_spare)
    : buffer_bytes_(buffer_bytes), spare_(std::make_shared<Spare>()) {
  spare_->limit = max_spare;
}

std::shared_ptr<AlignedBuffer> BufferPool::Take() {
  std::unique_ptr<AlignedBuffer> buffer;
  {
    const MutexLock lock(spare_->mutex);
    if (!spare_->buffers.empty()) {
      buffer = std::move(spare_->buffers.back());
      spare_->buffers.pop_back();
    }
  }
  if (!buffer) buffer = std::make_unique<AlignedBuffer>(buffer_bytes_);
  return {buffer.release(), [spare = spare_, bytes = buffer_bytes_](AlignedBuffer* used) {
            std::unique_ptr<AlignedBuffer> back(used);
            const MutexLock lock(spare->mutex);
            if (back->size() == bytes && spare->buffers.size() < spare->limit) {
              spare->buffers.push_back(std::move(back));
            }
          }};
}

}  // namespace weft
