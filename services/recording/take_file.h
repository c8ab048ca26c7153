// take.json: what stands beside the streams of a recorded take.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/take.pb.h"

namespace weft {

std::string TakeJsonFile(const std::string& take);

// A take that begins now, with a random id.
v1::Take NewTake(const std::string& origin);
// The id as the streams carry it.
uint64_t TakeNumber(const v1::Take& take);

absl::Status WriteTakeFile(const std::string& folder, const v1::Take& take);
// Takes whose take.json is missing (a crash at the very start) get one from their streams.
absl::StatusOr<v1::Take> ReadTakeFile(const std::string& folder);

// Numbers of a take from its streams and ledger: what `weft take info` shows. Errors of RecordedTake.
absl::StatusOr<v1::TakeInfo> DescribeTake(const std::string& folder);

}  // namespace weft
