#include "services/process/exit_status.h"

#include <cstdio>

#include "absl/strings/str_cat.h"

namespace weft {

int ExitStatusOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kExitDone;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kFailedPrecondition:
      return kExitBadInput;
    default:
      return kExitFailed;
  }
}

void PrintError(const absl::Status& status) {
  std::string line = "weft: error: ";
  if (status.message().empty()) {
    absl::StrAppend(&line, absl::StatusCodeToString(status.code()));
  } else {
    absl::StrAppend(&line, status.message());
  }
  std::fprintf(stderr, "%s\n", line.c_str());
}

void PrintWarning(const std::string& message) {
  std::fprintf(stderr, "weft: warning: %s\n", message.c_str());
}

}  // namespace weft
