// Makes recorded takes readable again after a crash or damage. Nothing that was recorded is destroyed.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/take/check_take.h"

namespace weft {

struct TakeRecoveryOptions {
  bool dry_run = false;              // says what would be done and changes nothing
  std::vector<std::string> cameras;  // that the take should have; one whose stream is gone gets gaps
  uint64_t take = 0;                 // number of the take, where streams do not tell; 0: unknown
  uint64_t sets_dropped =
      0;  // as take.json or an end record says it, where the ledger that says why is damaged
  std::vector<std::string> keep;  // files of the take's folder to keep aside, which the caller will replace
  std::map<std::string, std::string> descriptions;  // for the heads of streams whose own are damaged
};

struct TakeRecovery {
  uint64_t sets = 0;            // frame sets that the take has now
  uint64_t dropped = 0;         // frame sets that its ledger says were dropped
  uint64_t frames_missing = 0;  // frames of its sets that are not there, whatever the reason
  uint64_t brought_back = 0;    // sets that no index knew
  uint64_t frames_lost = 0;     // frames that were acknowledged and are gone: gaps stand in their places
  uint64_t frames_unfinished =
      0;                   // gaps in sets that were never acknowledged: the crash came between the cameras
  uint64_t cut_bytes = 0;  // that belong to no intact frame, kept aside
  uint64_t entries_added = 0;       // to the ledger
  int64_t ended_host_time_ns = 0;   // of the last frame, or as the take's end says
  std::vector<std::string> damage;  // what is lost, in words, with its place
  std::vector<std::string>
      changes;             // what was done (or would be), file by file; empty where nothing was to do
  std::string kept_aside;  // folder of what was replaced or cut; empty where there is nothing
};

// Every intact frame stays, byte by byte. A lost frame leaves a gap with its reason, so that all streams
// have the same sets. Indexes and ledger are rebuilt, and streams of this version end with an end record.
// Files that are replaced and bytes that are cut are kept in <take>/recovered/<number>. Calling it again
// changes nothing; a call that was interrupted is made again. FailedPrecondition: the take is being
// recorded. NotFound: no take. Errors of the file system.
absl::StatusOr<TakeRecovery> RecoverTake(const std::string& folder, const TakeRecoveryOptions& options = {});

}  // namespace weft
