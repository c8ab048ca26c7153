// Limits of what a process may have: open files, memory, sizes of files.
#pragma once

#include <cstdint>

#include "absl/status/status.h"

namespace weft {

// How many files and sockets it may have open: the soft limit, which is in force.
int64_t DescriptorLimit();

// Raises the soft limit to the hard one, and returns what is in force then. Nothing of ours uses select(2),
// which is why limits are low.
int64_t RaiseDescriptorLimit();

// Limits what this process and its threads may allocate (RLIMIT_DATA), so that one damaged input does not
// take the memory of the whole machine: allocations beyond it fail, files and libraries that are mapped do
// not count. A stricter limit that is in force stays. 0: nothing is done. Sanitizers reserve more than any
// limit, so there it does nothing either.
absl::Status LimitMemory(int64_t mib);

// From now on a write beyond the limit on the size of files (RLIMIT_FSIZE) fails with EFBIG, as one to a full
// disk does, instead of ending this process and those that it starts with SIGXFSZ.
void FailBeyondFileSize();

}  // namespace weft
