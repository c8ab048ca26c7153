// Checks recorded takes, byte by byte.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/take/take_format.h"

namespace weft {

struct TakeCheck {
  uint64_t take = 0;                 // the number that its streams carry
  std::vector<std::string> cameras;  // those that have a stream
  uint64_t sets = 0;                 // frame sets that every stream accounts for
  uint64_t complete_sets = 0;        // of them, with a frame of every camera
  uint64_t recorded = 0;             // frame sets of which anything knows
  uint64_t frames = 0;               // intact
  uint64_t missing =
      0;  // frames that the cameras did not deliver or that were lost, with their reason in the take
  uint64_t dropped = 0;               // frame sets that the ledger says were dropped
  uint64_t bytes = 0;                 // of all streams
  uint64_t unindexed = 0;             // intact frames that the index lacks: what `recover` brings back
  bool has_ends = false;              // streams of this version: closed ones end with a record
  std::optional<StreamEnd> end;       // of any stream
  std::vector<std::string> problems;  // everything that is not as it should be, in words, with its place
  std::vector<std::string> warnings;  // what harms no frame, and tells of a disk or a copy that loses bits
};

// Reads every byte of the take and checks every checksum; index against stream, ledger against both, streams
// against each other. `cameras` and `take` (0: unknown): what else is known of it, so that a stream that is
// gone is missed. A take whose `problems` are empty is whole. NotFound: the folder is no take. Errors of
// PosixFile.
absl::StatusOr<TakeCheck> VerifyTake(const std::string& folder, const std::vector<std::string>& cameras = {},
                                     uint64_t take = 0);

}  // namespace weft
