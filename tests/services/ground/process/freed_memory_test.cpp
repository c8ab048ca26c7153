#include "services/ground/process/freed_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <vector>

namespace weft {
namespace {

int64_t PageFaults() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

TEST(KeepFreedMemory, ArraysOfSomeMibAreClearedByTheKernelOnce) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers have an allocator of their own";
#endif
  KeepFreedMemory();
  constexpr size_t kBytes = size_t{8} << 20;
  std::vector<char>(kBytes, 1);
  const int64_t before = PageFaults();
  for (int i = 0; i < 10; ++i) std::vector<char>(kBytes, 1);
  constexpr int64_t kPagesOfArray = kBytes / 4096;
  EXPECT_LT(PageFaults() - before, kPagesOfArray / 4);
}

TEST(FreedMemory, GoesBackToTheKernel) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers have an allocator of their own";
#endif
  constexpr size_t kMib = size_t{1} << 20, kPiece = size_t{16} << 10;
  FreedMemory freed;
  freed.Requeue();
  const size_t before = ResidentBytes();
  std::vector<std::vector<char>> pieces(128 * kMib / kPiece);
  for (std::vector<char>& piece : pieces) piece.assign(kPiece, 1);
  // It lies above them and keeps the heap from shrinking by itself.
  const std::vector<char> last(kPiece, 1);
  pieces.clear();
  ASSERT_GT(ResidentBytes(), before + 100 * kMib);
  freed.Requeue();
  EXPECT_LT(ResidentBytes(), before + 16 * kMib);
}

}  // namespace
}  // namespace weft
