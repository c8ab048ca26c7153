#include "pattern/pixel_allocator.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace weft {
namespace {

constexpr size_t kHugePage = size_t{1} << 21;

}  // namespace

void* AllocatePixels(size_t bytes) {
  const size_t alignment = bytes < kHugePage ? 64 : kHugePage;
  const size_t rounded = (bytes + alignment - 1) / alignment * alignment;
  if (rounded < bytes) throw std::bad_alloc();
  void* memory = std::aligned_alloc(alignment, rounded);
  if (memory == nullptr) throw std::bad_alloc();
  // A wish: where it is not granted, ordinary pages serve as well.
  if (alignment == kHugePage) madvise(memory, rounded, MADV_HUGEPAGE);
  return memory;
}

void FreePixels(void* memory) { std::free(memory); }

}  // namespace weft
