#include "base/host_clock.h"

#include <time.h>

#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace weft {
namespace {

int64_t Time_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::string Utc(const char* format) { return absl::FormatTime(format, absl::Now(), absl::UTCTimeZone()); }

}  // namespace

int64_t HostTime_ns() { return Time_ns(CLOCK_REALTIME); }

int64_t MonotonicTime_ns() { return Time_ns(CLOCK_MONOTONIC); }

std::string UtcText() { return Utc("%Y-%m-%dT%H:%M:%SZ"); }

std::string UtcFileName() { return Utc("%Y%m%d-%H%M%S"); }

}  // namespace weft
