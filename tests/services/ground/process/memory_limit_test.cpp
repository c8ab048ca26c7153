#include "services/ground/process/memory_limit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

namespace weft {
namespace {

// Sanitizers reserve more than any limit.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// 0 where the limit is so many MiB after LimitMemory.
int LimitAfter(int64_t asked_mib, rlim_t expected_mib) {
  rlimit limit = {};
  if (!LimitMemory(asked_mib).ok() || getrlimit(RLIMIT_DATA, &limit) != 0) return 2;
  const rlim_t expected = expected_mib << 20;
  return limit.rlim_cur == expected && limit.rlim_max == expected ? 0 : 1;
}

TEST(MemoryLimit, HoldsAndOnlyEverFalls) {
  EXPECT_EXIT(_exit(LimitAfter(4096, 4096)), ::testing::ExitedWithCode(0), "");
  EXPECT_EXIT(_exit(LimitAfter(4096, 4096) + LimitAfter(2048, 2048) + LimitAfter(3000, 2048)),
              ::testing::ExitedWithCode(0), "");
}
#endif

TEST(MemoryLimit, IsNoneForZero) {
  rlimit before = {}, after = {};
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &before), 0);
  EXPECT_TRUE(LimitMemory(0).ok());
  EXPECT_TRUE(LimitMemory(-1).ok());
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &after), 0);
  EXPECT_EQ(after.rlim_cur, before.rlim_cur);
}

}  // namespace
}  // namespace weft
