// How many workers with how many threads suit this machine.
#pragma once

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

}  // namespace weft
