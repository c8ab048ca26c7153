#include "pattern/image/pixel_allocator.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace weft {
namespace {

constexpr size_t kBytes = size_t{16} << 20;

// Whether the page at `memory` is mapped and resident; false where it was given back.
bool IsResident(void* memory) {
  unsigned char resident = 0;
  const size_t page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  return mincore(memory, page, &resident) == 0 && (resident & 1) != 0;
}

TEST(PixelAllocator, FreedBlocksServeAgainUntilTheyAreGivenBack) {
  void* const first = AllocatePixels(kBytes);
  std::fill_n(static_cast<uint8_t*>(first), kBytes, uint8_t{1});
  FreePixels(first, kBytes);
  EXPECT_TRUE(IsResident(first));
  void* const again = AllocatePixels(kBytes);
  EXPECT_EQ(again, first);
  FreePixels(again, kBytes);
  ReleasePixels();
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which keep what is freed
  EXPECT_FALSE(IsResident(first));
#endif
}

TEST(PixelAllocator, BlocksInUseAreNotGivenBack) {
  PixelVector<uint8_t> pixels(kBytes, 7);
  ReleasePixels();
  EXPECT_TRUE(IsResident(pixels.data()));
  EXPECT_EQ(std::count(pixels.begin(), pixels.end(), 7), static_cast<std::ptrdiff_t>(kBytes));
}

}  // namespace
}  // namespace weft
