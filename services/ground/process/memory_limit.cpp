#include "services/ground/process/memory_limit.h"

#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace weft {

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

}  // namespace weft
