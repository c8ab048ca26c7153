// A daemon from its start to its end: what signals ask of it, and what the service manager is told.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/server/daemon/program/daemon.h"

namespace weft {

struct DaemonSetup {
  DaemonOptions options;
  std::string log_level = "info";
  std::string config_file;                      // empty: arguments alone
  std::map<std::string, std::string> settings;  // all options as text, by field (config_file.h)
};

// Returns when the daemon has stopped. SIGHUP calls `read_again`: what can change while the daemon runs does,
// what cannot is named in the log. Its errors change nothing. Errors of Daemon::Start.
absl::Status RunDaemon(DaemonSetup setup, const std::function<absl::StatusOr<DaemonSetup>()>& read_again);

}  // namespace weft
