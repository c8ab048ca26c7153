// How fast a disk takes frames, measured before a take rather than during it.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace weft {

struct DiskSpeed {
  double bytes_per_s = 0;
  double slowest_write_ms = 0;
  uint64_t free_bytes = 0;
  bool bypasses_page_cache = false;  // else the file system has no O_DIRECT, and the figure includes memory
};

// Writes and removes a file of `bytes` in the folder, in the recorder's way: preallocated, whole frames,
// flushed. Errors of PosixFile; ResourceExhausted: there is no room for it.
absl::StatusOr<DiskSpeed> MeasureDiskSpeed(const std::string& folder, uint64_t bytes);

}  // namespace weft
