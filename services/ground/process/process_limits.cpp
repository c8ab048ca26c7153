#include "services/ground/process/process_limits.h"

#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"

namespace weft {

int64_t DescriptorLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  return static_cast<int64_t>(std::min<rlim_t>(limit.rlim_cur, std::numeric_limits<int64_t>::max()));
}

int64_t RaiseDescriptorLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < limit.rlim_max) {
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
  }
  return DescriptorLimit();
}

absl::Status LimitMemory(int64_t mib) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  mib = 0;
#endif
  if (mib <= 0) return absl::OkStatus();
  rlimit limit = {};
  if (getrlimit(RLIMIT_DATA, &limit) == 0) {
    const auto wanted = static_cast<rlim_t>(mib) << 20;
    limit.rlim_cur = std::min(limit.rlim_cur, wanted);
    limit.rlim_max = std::min(limit.rlim_max, wanted);
    if (setrlimit(RLIMIT_DATA, &limit) == 0) return absl::OkStatus();
  }
  return absl::InternalError(
      absl::StrCat("the memory cannot be limited to ", mib, " MiB (", std::strerror(errno), ")"));
}

void FailBeyondFileSize() { signal(SIGXFSZ, SIG_IGN); }

}  // namespace weft
