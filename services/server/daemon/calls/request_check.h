// Checks that a request is well-formed, without reading files.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/jobs.pb.h"
#include "weft/v1/server.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {

// InvalidArgument names the field: missing, too long, control characters, a range that is none, an unknown
// preset, a hash that is none.
absl::Status CheckSubmitRequest(const v1::SubmitJobRequest& request);

// Of a list: 0 is 100, and no more than 1000 are given. InvalidArgument: negative.
absl::StatusOr<int> LimitOf(int limit);
// Of a list that is given whole where nobody says otherwise: 0 is all of it.
absl::StatusOr<int> LimitOrAll(int limit);
// As a page before told it, or empty.
absl::Status CheckPageToken(const std::string& token);
// A name that others read. InvalidArgument: too long, control characters.
absl::Status CheckOwner(const std::string& owner);
// The same of a text as long as a path may be.
absl::Status CheckOneLine(const std::string& field, const std::string& text);
// Of a take. InvalidArgument names the field: too long, or control characters beside the ends of lines in
// `notes`.
absl::Status CheckDescription(const v1::DescribeTakeRequest& request);
// -100 to 100.
absl::Status CheckPriority(int priority);
// Of a file or folder, without folders above it; may be empty.
absl::Status CheckPlainName(const std::string& field, const std::string& name);
// Empty, or fit for the name of a folder.
absl::Status CheckKey(const std::string& idempotency_key);
absl::Status CheckJobId(const std::string& job_id);
absl::Status CheckTakeId(const std::string& take_id);
// No rule is negative or no number, and `ahead_days` is in its range.
absl::Status CheckRehearsal(const v1::RehearseRetentionRequest& request);
// Of a file that is fetched.
absl::Status CheckOffset(int64_t offset);
absl::Status CheckFetchRequest(const v1::FetchResultRequest& request);

}  // namespace weft
