// Whose results stand in a folder.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/server/callers/caller.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Whether the caller may have a job with these frames write to its spec.out, which is canonical. job.json
// says whose results are: of the folder itself, of those that it lies in, and of those where its frames will
// stand. Results without one, or without a caller in it, are nobody's. PermissionDenied as CheckMayChange.
absl::Status CheckResultOwner(const v1::Job& job, const std::vector<std::string>& frames,
                              const Caller& caller);

}  // namespace weft
