// Memory for whole images, and for what is as large.
#pragma once

#include <cstddef>
#include <vector>

namespace weft {

// Memory for `bytes` bytes. Large blocks are in huge pages where the system gives them. They are kept for
// the next image that fits instead of being returned: to touch new memory takes longer than to find all
// blobs in it. Throws std::bad_alloc. Thread-safe.
void* AllocatePixels(size_t bytes);
void FreePixels(void* memory, size_t bytes);
// Gives the blocks that wait to be used again back to the system, and what else the heap holds free: where
// decoding is over and other work comes. Thread-safe.
void ReleasePixels();

// Leaves elements uninitialised when a vector is made or grown without values.
template <typename T>
struct PixelAllocator {
  using value_type = T;

  PixelAllocator() = default;
  template <typename U>
  PixelAllocator(const PixelAllocator<U>&) {}

  T* allocate(size_t n) { return static_cast<T*>(AllocatePixels(n * sizeof(T))); }
  void deallocate(T* memory, size_t n) { FreePixels(memory, n * sizeof(T)); }
  template <typename U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <typename U, typename... Args>
  void construct(U* at, Args&&... args) {
    ::new (static_cast<void*>(at)) U(static_cast<Args&&>(args)...);
  }
  bool operator==(const PixelAllocator&) const = default;
};

template <typename T>
using PixelVector = std::vector<T, PixelAllocator<T>>;

}  // namespace weft
