#include "services/server/daemon/work/cores.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace weft {
namespace {

TEST(ShareCores, UsesAllCoresUnlessTold) {
  const struct {
    int cores, workers, threads, expected_workers, expected_threads;
  } cases[] = {{2, 0, 0, 1, 2},   {16, 0, 0, 4, 4}, {1, 0, 0, 1, 1}, {6, 3, 0, 3, 2},
               {6, 12, 0, 12, 1}, {6, 0, 2, 3, 2},  {6, 0, 9, 1, 9}, {6, 5, 7, 5, 7}};
  for (const auto& c : cases) {
    const CoreShare share = ShareCores(c.cores, c.workers, c.threads);
    EXPECT_EQ(share.workers, c.expected_workers) << c.cores << " " << c.workers << " " << c.threads;
    EXPECT_EQ(share.threads_per_worker, c.expected_threads)
        << c.cores << " " << c.workers << " " << c.threads;
  }
}

TEST(ShareMemory, LeavesEachWorkerFourGibibytesAtLeast) {
  EXPECT_EQ(ShareMemoryMib(100'000, 4), 25'000);
  EXPECT_EQ(ShareMemoryMib(16'384, 4), 4096);
  EXPECT_EQ(ShareMemoryMib(16'000, 4), 4096);
  EXPECT_EQ(ShareMemoryMib(10'000, 0), 10'000);
}

TEST(UsableMemory, IsAtMostThatOfTheMachine) {
  const int64_t physical_bytes = int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE);
  EXPECT_GT(UsableMemoryMib(), 64);
  EXPECT_LE(UsableMemoryMib(), physical_bytes / (1024 * 1024));
}

TEST(UsableCores, AreAtLeastOne) { EXPECT_GE(UsableCores(), 1); }

}  // namespace
}  // namespace weft
