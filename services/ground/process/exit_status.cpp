#include "services/ground/process/exit_status.h"

#include <sys/wait.h>

#include <cstdio>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"

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
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kFailedPrecondition:
      return kExitBadInput;
    default:
      return kExitFailed;
  }
}

std::string DescribeExit(int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    const int signal = WTERMSIG(wait_status);
    return absl::StrCat("killed by signal ", signal, " (", strsignal(signal), ")");
  }
  return absl::StrCat("exit status ", WEXITSTATUS(wait_status));
}

void PrintError(const absl::Status& status) {
  const std::string message = status.message().empty() ? absl::StatusCodeToString(status.code())
                                                       : MessageText(std::string(status.message()));
  std::fprintf(stderr, "weft: error: %s\n", message.c_str());
}

void PrintWarning(const std::string& message) {
  std::fprintf(stderr, "weft: warning: %s\n", MessageText(message).c_str());
}

}  // namespace weft
