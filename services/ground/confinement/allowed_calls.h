// The system calls that a confined process may make, enforced by seccomp.
#pragma once

#include "absl/status/status.h"

namespace weft {

struct CallNeeds {
  bool may_run_programs = false;
};

// The calling thread and what it starts make the calls of a list and no others: files, memory, threads and
// time of this process. Files are opened without set-id bits; their modes, owners, times and attributes stay.
// Other processes are neither signalled, traced, limited nor scheduled. With `may_run_programs` processes are
// started, and talk to this one by socket pairs. Other calls answer EPERM, and ENOSYS those that are newer
// than the installed libseccomp, so that the C library makes an older one. Sanitizers keep what their search
// for leaks needs. Unavailable: the kernel has no filters.
absl::Status AllowCallsOf(const CallNeeds& needs);

// For processes that need devices, the network and real time: denies by name what changes files in other ways
// than by writing, other processes' memory, and the machine. What is not named is allowed. Unavailable.
absl::Status DenyCallsOnOthers();

}  // namespace weft
