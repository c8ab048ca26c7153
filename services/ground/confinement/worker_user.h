// Workers of a daemon that root started run as another user.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace weft {

// InvalidArgument: no such user, or it is root. FailedPrecondition: this process may not change its user, or
// the kernel has no Landlock, without which the user would be of little use.
absl::Status CheckWorkerUser(const std::string& name);

// This process gets the user and its groups, and loses all capabilities but one: it may read and write files
// of others (CAP_DAC_OVERRIDE), since the daemon's folder is closed. Confine it at once, then that is true of
// its own job's files alone. Signals of PR_SET_PDEATHSIG are lost. Errors as CheckWorkerUser; Unavailable.
absl::Status BecomeWorkerUser(const std::string& name);

}  // namespace weft
