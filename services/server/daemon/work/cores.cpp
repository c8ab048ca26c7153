#include "services/server/daemon/work/cores.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <thread>

namespace weft {

int UsableCores() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

CoreShare ShareCores(int cores, int workers, int threads_per_worker) {
  constexpr int kMostThreads = 4;
  CoreShare share{workers, threads_per_worker};
  if (share.threads_per_worker == 0) {
    share.threads_per_worker =
        workers == 0 ? std::clamp(cores, 1, kMostThreads) : std::max(1, cores / workers);
  }
  if (share.workers == 0) share.workers = std::max(1, cores / share.threads_per_worker);
  return share;
}

int64_t UsableMemoryMib() {
  int64_t mib = (int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE)) >> 20;
  int64_t bytes = 0;
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> bytes) mib = std::min(mib, bytes >> 20);
  return mib;
}

int64_t ShareMemoryMib(int64_t memory_mib, int workers) {
  constexpr int64_t kLeastMib = 4096;
  return std::max(kLeastMib, memory_mib / std::max(1, workers));
}

}  // namespace weft
