// A short program, from its start to its end.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct ProgramRun {
  std::vector<std::string> arguments;
  std::string input;  // a file that it reads as its standard input; empty: nothing
  std::chrono::milliseconds patience{std::chrono::seconds(30)};
  size_t most_bytes = size_t{1} << 20;  // of its output; what comes after them is dropped
  std::stop_token stop;
  bool hides_secrets = false;  // ChildSettings
};

// What `program`, which no shell looks for, printed on its standard output. What it leaves running is ended
// with it. NotFound, PermissionDenied: it cannot be started. DeadlineExceeded: it took longer; the message
// has the end of what it printed. Internal: another exit status than 0; the message has the end of what it
// printed. Cancelled: `stop` was requested.
absl::StatusOr<std::string> RunProgram(const std::string& program, const ProgramRun& run);

}  // namespace weft
