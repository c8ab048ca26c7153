#include "services/process/freed_memory.h"

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

}  // namespace
}  // namespace weft
