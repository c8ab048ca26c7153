// A job of a command: here, or at a daemon.
#pragma once

#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/work/pipeline/registration.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct JobRun {
  v1::RegistrationSpec spec;
  std::string command;  // "register"; of the bar, and for those who find the folder locked
  std::string server;   // empty: here
  int priority = 0;     // at a daemon
  RegistrationLimits limits;
};

// Shows the job and, once, its warnings until it has ended. Errors of RunLocalJob and RegisterRemotely.
absl::StatusOr<v1::Job> RunJob(const JobRun& run, bool quiet, const std::stop_token& stop);

// Leaves it to the daemon and prints its id. InvalidArgument: no server. Errors of SubmitRemotely.
absl::Status DetachJob(const JobRun& run);

}  // namespace weft
