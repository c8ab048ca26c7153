// Why something failed, for programs: messages are for people, and their words change.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace weft {

// What passes by itself, or once somebody makes room. The values are those of weft.v1.ErrorReason.
enum class ErrorReason {
  kNone = 0,
  kDiskFull = 1,      // or a quota, or a limit on the size of files
  kNoFreeThread = 2,  // or process
};

// The error with a reason, which functions that rewrite messages keep (WithMessage).
absl::Status WithReason(absl::Status status, ErrorReason reason);
ErrorReason ReasonOf(const absl::Status& status);

// The error with another message, and all else that it carries.
absl::Status WithMessage(const absl::Status& status, const std::string& message);

}  // namespace weft
