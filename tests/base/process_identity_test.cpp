#include "base/process_identity.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace weft {
namespace {

double UptimeInTicks() {
  double uptime_s = 0;
  std::ifstream("/proc/uptime") >> uptime_s;
  return uptime_s * static_cast<double>(sysconf(_SC_CLK_TCK));
}

TEST(ProcessIdentity, SaysWhenAProcessStarted) {
  const double before = UptimeInTicks();
  const pid_t child = fork();
  if (child == 0) {
    for (;;) pause();
  }
  const auto start = static_cast<double>(StartOfProcess(child));
  EXPECT_GE(start, before - 2);
  EXPECT_LE(start, UptimeInTicks() + 2);
  EXPECT_GE(start, static_cast<double>(StartOfProcess(getpid())));
  kill(child, SIGKILL);
  siginfo_t info;
  waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOWAIT);
  EXPECT_EQ(StartOfProcess(child), -1);  // it has ended, and nobody took note
  waitpid(child, nullptr, 0);
  EXPECT_EQ(StartOfProcess(child), 0);
}

TEST(ProcessIdentity, IsThatOfThisBootAndSpace) {
  EXPECT_EQ(BootId().size(), 36u);  // a UUID
  EXPECT_EQ(PidNamespace().rfind("pid:[", 0), 0u);
  EXPECT_EQ(KernelText("/proc/no such file"), "");
  EXPECT_EQ(KernelText("/proc/self/comm"), "base_test");
}

}  // namespace
}  // namespace weft
