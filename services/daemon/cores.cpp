#include "services/daemon/cores.h"

#include <sched.h>

#include <algorithm>
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

}  // namespace weft
