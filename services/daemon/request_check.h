// Checks that a request is well-formed, without reading files.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// InvalidArgument names the field: missing, too long, control characters, a range that is none, an unknown
// preset, a hash that is none.
absl::Status CheckSubmitRequest(const v1::SubmitJobRequest& request);

// Empty, or fit for the name of a folder.
absl::Status CheckKey(const std::string& idempotency_key);
absl::Status CheckJobId(const std::string& job_id);
absl::Status CheckTakeId(const std::string& take_id);
absl::Status CheckFetchRequest(const v1::FetchResultRequest& request);

}  // namespace weft
