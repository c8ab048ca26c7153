// Checking and repair of recorded takes as a whole: streams, indexes, ledger and take.json.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/take.pb.h"

namespace weft {

// VerifyTake (capture/take/check_take.h), take.json against all of it, and the verdict. NotFound: no recorded
// take.
absl::StatusOr<v1::TakeCheckReport> VerifyRecordedTake(const std::string& folder);

struct TakeRecoveryChoice {
  bool force = false;    // also takes that were closed
  bool dry_run = false;  // say what would be done, change nothing
};
// RecoverTake (capture/take/recover_take.h); then take.json follows. What was replaced or cut, and the report
// as recovery.json, stay in <take>/recovered/<number>. FailedPrecondition: the take was closed and `force` is
// not set, or it is being recorded.
absl::StatusOr<v1::TakeRecoveryReport> RecoverRecordedTake(const std::string& folder,
                                                           const TakeRecoveryChoice& choice = {});

// Removes what recoveries kept aside; the number of its bytes. FailedPrecondition: the take is being written.
absl::StatusOr<uint64_t> PurgeRecovered(const std::string& folder);

}  // namespace weft
