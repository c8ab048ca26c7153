// Checks recorded takes, and makes them readable again after a crash.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct TakeCheck {
  uint64_t sets = 0;       // frame sets that every stream accounts for
  uint64_t frames = 0;     // of them, intact
  uint64_t missing = 0;    // frames that the cameras did not deliver, with their reason in the take
  uint64_t dropped = 0;    // frame sets that the ledger says were dropped
  uint64_t bytes = 0;      // of all streams
  uint64_t unindexed = 0;  // intact frames that the index lacks: what `recover` brings back
  std::vector<std::string> problems;  // everything that is not as it should be, in words, with its place
};

// Reads every byte of the take and checks every checksum; index against stream, ledger against both, streams
// against each other. A take whose `problems` are empty is whole. Errors: the folder is no take, or a stream
// cannot be read.
absl::StatusOr<TakeCheck> VerifyTake(const std::string& folder);

struct TakeRecovery {
  uint64_t sets = 0;                // frame sets that the take has now
  uint64_t brought_back = 0;        // of them, not known to the index before
  uint64_t cut_off = 0;             // frames of the last sets that not every camera had reached the disk with
  uint64_t entries_added = 0;       // to the ledger
  std::vector<std::string> damage;  // that no index explains: frames that are lost, with their place
};

// Cuts every stream after the last frame set that all of them hold, rebuilds the indexes and completes the
// ledger. What was flushed before the crash stays byte by byte; calling it again changes nothing.
// FailedPrecondition: the take is being recorded. Errors of the file system.
absl::StatusOr<TakeRecovery> RecoverTake(const std::string& folder);

}  // namespace weft
