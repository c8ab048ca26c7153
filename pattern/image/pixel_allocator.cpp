#include "pattern/image/pixel_allocator.h"

#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <new>
#include <vector>

#include "base/mutex.h"

namespace weft {
namespace {

constexpr size_t kHugePage = size_t{1} << 21;
// A larger block is not used for less: it may be needed itself, and what is in use may stay so for long.
constexpr size_t kMostOfNeeded = 2;

struct Block {
  void* memory;
  size_t bytes;
};

// Large blocks in use, and those that wait to be used again: for as much as they hold or for less. Together
// they never have more bytes than were in use at some time.
class Pool {
 public:
  ~Pool() { DropFree(); }

  void DropFree() {
    const MutexLock lock(mutex_);
    for (const Block& block : free_) std::free(block.memory);
    free_.clear();
    free_bytes_ = 0;
  }

  void* Take(size_t bytes) {
    const MutexLock lock(mutex_);
    // The smallest that is large enough; of equal ones the last that came back, which the cache may hold.
    auto best = free_.end();
    for (auto at = free_.begin(); at != free_.end(); ++at) {
      if (at->bytes >= bytes && at->bytes <= kMostOfNeeded * bytes &&
          (best == free_.end() || at->bytes <= best->bytes))
        best = at;
    }
    if (best == free_.end()) {
      used_.push_back(NewBlock(bytes));
    } else {
      used_.push_back(*best);
      free_bytes_ -= best->bytes;
      free_.erase(best);
    }
    used_bytes_ += used_.back().bytes;
    most_used_bytes_ = std::max(most_used_bytes_, used_bytes_);
    DropOldest();
    return used_.back().memory;
  }

  void Return(void* memory) {
    const MutexLock lock(mutex_);
    const auto at =
        std::find_if(used_.begin(), used_.end(), [&](const Block& b) { return b.memory == memory; });
    used_bytes_ -= at->bytes;
    free_bytes_ += at->bytes;
    free_.push_back(*at);
    used_.erase(at);
    DropOldest();
  }

 private:
  static Block NewBlock(size_t bytes) {
    void* memory = std::aligned_alloc(kHugePage, bytes);
    if (memory == nullptr) throw std::bad_alloc();
    // A wish: where it is not granted, ordinary pages serve as well.
    madvise(memory, bytes, MADV_HUGEPAGE);
    return {memory, bytes};
  }

  // Frees the blocks that have waited longest while there are too many.
  void DropOldest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    size_t dropped = 0;
    for (; used_bytes_ + free_bytes_ > most_used_bytes_; ++dropped) {
      free_bytes_ -= free_[dropped].bytes;
      std::free(free_[dropped].memory);
    }
    free_.erase(free_.begin(), free_.begin() + static_cast<std::ptrdiff_t>(dropped));
  }

  Mutex mutex_;
  std::vector<Block> used_ ABSL_GUARDED_BY(mutex_), free_ ABSL_GUARDED_BY(mutex_);
  size_t free_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  size_t used_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  size_t most_used_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
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
  if (bytes >= kHugePage) return ThePool().Return(memory);
  ::operator delete(memory);
}

void ReleasePixels() {
  ThePool().DropFree();
  malloc_trim(0);
}

}  // namespace weft
