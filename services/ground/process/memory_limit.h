// A limit on the memory of this process, so that one damaged input does not take that of the whole machine.
#pragma once

#include <cstdint>

#include "absl/status/status.h"

namespace weft {

// Limits what this process and its threads may allocate (RLIMIT_DATA): allocations beyond it fail, files and
// libraries that are mapped do not count. A stricter limit that is in force stays. 0: nothing is done.
// Sanitizers reserve more than any limit, so there it does nothing either.
absl::Status LimitMemory(int64_t mib);

}  // namespace weft
