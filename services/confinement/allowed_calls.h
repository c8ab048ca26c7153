// System calls that no worker needs, denied by seccomp.
#pragma once

#include "absl/status/status.h"

namespace weft {

struct CallNeeds {
  bool may_run_programs = false;
  bool may_use_sockets = false;
};

// Denies (EPERM) sockets, other programs, the memory of other processes, mounts, name spaces, the kernel's
// modules, keys, clocks and tracing, for the calling thread and what it starts. A list of what is denied
// instead of what is allowed: libraries and sanitizers choose their calls freely, and files are Landlock's.
// Sanitizers keep ptrace, with which they look for leaks. Unavailable: the kernel has no filters.
absl::Status DenyCalls(const CallNeeds& limits);

}  // namespace weft
