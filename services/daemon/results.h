// Files of a job's results, for clients.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Where the file lies. `frame` must be one of the job's. NotFound: it does not exist (yet). PermissionDenied:
// a link that leads out of the job's folder.
absl::StatusOr<std::string> FindResult(const v1::Job& job, const std::string& frame, v1::ResultKind kind);

}  // namespace weft
