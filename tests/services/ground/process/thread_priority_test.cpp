#include "services/ground/process/thread_priority.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <thread>

namespace weft {
namespace {

int Niceness() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(YieldToOthers, ChangesTheCallingThreadAlone) {
  const int before = Niceness();
  int within = -1;
  std::thread([&within] {
    YieldToOthers(19);
    within = Niceness();
  }).join();
  EXPECT_EQ(within, 19);
  EXPECT_EQ(Niceness(), before);
}

}  // namespace
}  // namespace weft
