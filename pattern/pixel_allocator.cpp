#include "pattern/pixel_allocator.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <new>
#include <vector>

namespace weft {
namespace {

constexpr size_t kHugePage = size_t{1} << 21;

struct Block {
  void* memory;
  size_t bytes;
};

// Large blocks that wait to be used again. There are never more bytes in use and waiting together than were
// in use at some time.
class Pool {
 public:
  ~Pool() {
    for (const Block& block : free_) std::free(block.memory);
  }

  void* Take(size_t bytes) {
    const std::lock_guard lock(mutex_);
    auto at = std::find_if(free_.begin(), free_.end(), [&](const Block& b) { return b.bytes == bytes; });
    void* memory = nullptr;
    if (at != free_.end()) {
      memory = at->memory;
      free_bytes_ -= bytes;
      free_.erase(at);
    } else {
      memory = std::aligned_alloc(kHugePage, bytes);
      if (memory == nullptr) throw std::bad_alloc();
      // A wish: where it is not granted, ordinary pages serve as well.
      madvise(memory, bytes, MADV_HUGEPAGE);
    }
    used_bytes_ += bytes;
    most_used_bytes_ = std::max(most_used_bytes_, used_bytes_);
    return memory;
  }

  void Return(void* memory, size_t bytes) {
    const std::lock_guard lock(mutex_);
    free_.push_back({memory, bytes});
    free_bytes_ += bytes;
    used_bytes_ -= bytes;
    DropTo(most_used_bytes_);
  }

 private:
  // Frees the blocks that have waited longest.
  void DropTo(size_t bytes) {
    size_t dropped = 0;
    while (free_bytes_ > bytes) {
      free_bytes_ -= free_[dropped].bytes;
      std::free(free_[dropped++].memory);
    }
    free_.erase(free_.begin(), free_.begin() + static_cast<std::ptrdiff_t>(dropped));
  }

  std::mutex mutex_;
  std::vector<Block> free_;
  size_t free_bytes_ = 0, used_bytes_ = 0, most_used_bytes_ = 0;
};

Pool& ThePool() {
  static Pool pool;
  return pool;
}

size_t RoundedUp(size_t bytes, size_t unit) {
  const size_t rounded = (bytes + unit - 1) / unit * unit;
  if (rounded < bytes) throw std::bad_alloc();
  return rounded;
}

}  // namespace

void* AllocatePixels(size_t bytes) {
  if (bytes >= kHugePage) return ThePool().Take(RoundedUp(bytes, kHugePage));
  return ::operator new(bytes);
}

void FreePixels(void* memory, size_t bytes) {
  if (bytes >= kHugePage) return ThePool().Return(memory, RoundedUp(bytes, kHugePage));
  ::operator delete(memory);
}

}  // namespace weft
