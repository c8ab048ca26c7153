#include "services/work/worker/worker_usage.h"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace weft {
namespace {

constexpr double kMib = 1 << 20, kKibPerMib = 1024;

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}

double SinceBoot_s() {
  timespec now = {};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// proc(5): field 22 of /proc/self/stat, in ticks. The second one, in parentheses, may hold spaces.
double ProcessStart_s() {
  std::ifstream file("/proc/self/stat");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) return SinceBoot_s();
  std::istringstream fields(text.substr(name_end + 1));
  std::string word;
  constexpr int kFieldsBefore = 22 - 3;
  for (int i = 0; i < kFieldsBefore; ++i) fields >> word;
  double ticks = 0;
  const auto ticks_per_s = static_cast<double>(sysconf(_SC_CLK_TCK));
  return fields >> ticks ? ticks / ticks_per_s : SinceBoot_s();
}

}  // namespace

UsageMeter::UsageMeter() : started_s_(ProcessStart_s()) {}

v1::WorkerUsage UsageMeter::Now() const {
  v1::WorkerUsage taken;
  taken.set_wall_s(std::max(0.0, SinceBoot_s() - started_s_));
  double core_s = 0, peak_kib = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used = {};
    if (getrusage(who, &used) != 0) continue;
    core_s += Seconds(used.ru_utime) + Seconds(used.ru_stime);
    peak_kib = std::max(peak_kib, static_cast<double>(used.ru_maxrss));
  }
  taken.set_core_s(core_s);
  taken.set_peak_memory_mib(peak_kib / kKibPerMib);
  // Of the main thread, in ns: on a core, and waiting for one (Documentation/scheduler/sched-stats.rst).
  double ran_ns = 0, waited_ns = 0;
  if (std::ifstream("/proc/self/schedstat") >> ran_ns >> waited_ns) taken.set_delay_s(waited_ns * 1e-9);
  std::ifstream file("/proc/self/io");
  std::string name;
  for (double bytes = 0; file >> name >> bytes;) {
    if (name == "rchar:") taken.set_read_mib(bytes / kMib);
    if (name == "wchar:") taken.set_written_mib(bytes / kMib);
  }
  return taken;
}

}  // namespace weft
