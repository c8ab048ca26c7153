// What an outcome means to the shell, and how a program of Weft says it.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace weft {

// 0 done, 1 failed, 2 bad arguments or input.
enum ExitStatus : int { kExitDone = 0, kExitFailed = 1, kExitBadInput = 2 };

// The only mapping from an outcome to the exit status. InvalidArgument, NotFound, OutOfRange,
// AlreadyExists, PermissionDenied and FailedPrecondition (inputs that do not fit each other) are bad
// input. Every other error is a failure.
int ExitStatusOf(const absl::Status& status);

// Of another process, by the status of waitpid: "exit status 3", "killed by signal 11 (Segmentation fault)".
std::string DescribeExit(int wait_status);

// "weft: error: ..." on stderr, with a category where the message alone may not say enough.
void PrintError(const absl::Status& status);
// "weft: warning: ..." on stderr.
void PrintWarning(const std::string& message);

}  // namespace weft
