// A job of a command: here, or at a daemon.
#pragma once

#include <CLI/CLI.hpp>

#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/work/pipeline/registration.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Options of commands whose job a daemon may do.
struct JobAtDaemon {
  std::string server;  // empty: here
  bool upload = false, detach = false;
  int priority = 0;
};
// --server, --upload, --priority and --detach. `upload`: what is sent with --upload.
void AddJobAtDaemon(CLI::App& command, JobAtDaemon& daemon, const std::string& upload);

struct JobRun {
  v1::RegistrationSpec spec;
  std::string command;  // "register"; of the bar, and for those who find the folder locked
  std::string server;   // empty: here
  int priority = 0;     // at a daemon
  RegistrationLimits limits;
};

// Shows the job and, once, its warnings until it has ended. Results of a daemon that does not see the output
// folder are brought to it. A stop cancels the job. Errors of RunLocalJob, and those of the daemon.
absl::StatusOr<v1::Job> RunJob(const JobRun& run, bool quiet, const std::stop_token& stop);

// Leaves it to the daemon and prints its id. InvalidArgument: no server. Errors of the daemon.
absl::Status DetachJob(const JobRun& run);

}  // namespace weft
