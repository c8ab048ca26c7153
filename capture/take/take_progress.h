// How far the recording of a take is, by its ledger alone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct RecordedSet {
  uint64_t number = 0;
  int64_t host_time_ns = 0;  // CLOCK_REALTIME, when the recorder noticed it
};

struct TakeProgress {
  std::vector<RecordedSet> sets;  // those on the disk, in order
  bool closed = false;            // no set will follow
};

// Also while another process records the take. NotFound: the folder holds no recorded take. Otherwise errors
// of the disk.
absl::StatusOr<TakeProgress> ReadTakeProgress(const std::string& folder);

}  // namespace weft
