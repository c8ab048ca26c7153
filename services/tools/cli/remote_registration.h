// A job that a daemon does for `weft register --server`.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Submits the job; relative paths of `spec` become absolute. The daemon writes into spec.out itself when it
// sees the same folder, otherwise below its own state folder (then the returned job's spec.out is another).
absl::StatusOr<v1::Job> SubmitRemotely(const std::string& server, const v1::RegistrationSpec& spec,
                                       int priority);

// Submits the job, watches it to its end, and brings the results to spec.out where the daemon could not write
// there. A stop cancels the job. `fetched` is called with the frames brought and all of them.
absl::StatusOr<v1::Job> RegisterRemotely(const std::string& server, const v1::RegistrationSpec& spec,
                                         int priority,
                                         const std::function<void(const v1::JobUpdate&)>& update,
                                         const std::function<void(size_t done, size_t total)>& fetched,
                                         std::stop_token stop);

}  // namespace weft
