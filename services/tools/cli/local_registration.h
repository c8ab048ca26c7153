// A job that `weft register` runs itself.
#pragma once

#include <functional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "services/work/pipeline/registration.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Registers the frames of `spec` in this process within `limits` and keeps <out>/job.json
// and, at the end, <out>/report.html. `update` hears of every change, as a watcher of the daemon would.
// Returns the job as it ended, cancelled included; an error when it could not start or its results cannot be
// written.
absl::StatusOr<v1::Job> RegisterLocally(const v1::RegistrationSpec& asked, const RegistrationLimits& limits,
                                        const std::function<void(const v1::JobUpdate&)>& update,
                                        std::stop_token stop);

}  // namespace weft
