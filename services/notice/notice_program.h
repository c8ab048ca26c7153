// Notices for a program.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "absl/status/status.h"

namespace weft {

// Runs `program`, without a shell and without arguments, on the file `path` as its standard input, and waits
// for it. What it leaves running is ended with it. NotFound, PermissionDenied: it cannot be started.
// DeadlineExceeded: it took longer than `patience`. Internal: another exit status than 0; the message has the
// end of what it printed. Cancelled: `stop` was requested.
absl::Status RunNoticeProgram(const std::string& program, const std::string& path,
                              std::chrono::milliseconds patience, const std::stop_token& stop);

}  // namespace weft
