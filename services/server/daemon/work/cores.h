// How many workers with how many threads and how much memory suit this machine.
#pragma once

#include <cstdint>

namespace weft {

// Cores that this process may run on.
int UsableCores();

struct CoreShare {
  int workers = 1;
  int threads_per_worker = 1;
};

// Fills in what is 0, so that workers times threads is about `cores`; at most 4 threads per worker, since
// frames run side by side better than parts of one.
CoreShare ShareCores(int cores, int workers, int threads_per_worker);

// Memory of this machine, or of the control group that this process runs in where that has less.
int64_t UsableMemoryMib();

// The memory limit of each of so many workers: an equal share, but never less than 4 GiB, since fewer
// large frames than workers may be in progress.
int64_t ShareMemoryMib(int64_t memory_mib, int workers);

}  // namespace weft
