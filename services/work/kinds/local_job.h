// A job that this process computes itself.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "services/work/pipeline/registration.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

struct LocalJobRequest {
  v1::RegistrationSpec spec;
  // The same with absolute paths, for job.json, which others read from other folders.
  v1::RegistrationSpec recorded;
  std::string command;  // "weft register", for those who find the folder locked
  RegistrationLimits limits;
};

// Computes all frames, and again those whose results are not there at the end; keeps <out>/job.json and, at
// the end, <out>/report.html. A stopped run is resumed by the same request. `update`, which may be empty,
// hears of every change, as a watcher of the daemon would. Returns the job as it ended, cancelled included;
// an error when it could not start or its results cannot be written.
absl::StatusOr<v1::Job> RunLocalJob(const LocalJobRequest& request,
                                    const std::function<void(const v1::JobUpdate&)>& update,
                                    const std::stop_token& stop);

}  // namespace weft
