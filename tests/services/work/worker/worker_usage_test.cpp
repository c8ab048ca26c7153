#include "services/work/worker/worker_usage.h"

#include <gtest/gtest.h>
#include <time.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

double ProcessorTime_s() {
  timespec now = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

TEST(UsageMeter, CountsWorkAndFiles) {
  const UsageMeter meter;
  const v1::WorkerUsage before = meter.Now();
  const double begun_s = ProcessorTime_s();
  while (ProcessorTime_s() - begun_s < 0.2) {
  }
  const TempFolder folder;
  std::ofstream(folder / "file") << std::string(4 << 20, 'x');
  std::string read(4 << 20, 0);
  std::ifstream(folder / "file").read(read.data(), static_cast<std::streamsize>(read.size()));
  const v1::WorkerUsage after = meter.Now();
  const double core_s = after.core_s() - before.core_s();
  EXPECT_GE(core_s, 0.19);
  EXPECT_LE(core_s, ProcessorTime_s() - begun_s + 0.05);
  // All of it lies between start and now, and waiting for a core is no work.
  EXPECT_GE(after.wall_s() - before.wall_s() + 0.05, core_s + after.delay_s() - before.delay_s());
  EXPECT_GE(before.wall_s(), 0);
  EXPECT_NEAR(after.read_mib() - before.read_mib(), 4, 0.5);
  EXPECT_NEAR(after.written_mib() - before.written_mib(), 4, 0.5);
  EXPECT_GT(after.peak_memory_mib(), 4);
}

}  // namespace
}  // namespace weft
