// The files of a take that is being recorded: a stream per camera and the ledger. No threads of its own; the
// recorder (services/studio/recording) brings them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/sync/ledger.h"
#include "capture/take/stream_writer.h"

namespace weft {

struct TakeWriterOptions {
  StreamWriterOptions stream;
  uint64_t take = 0;                      // random number of the take
  std::vector<std::string> descriptions;  // of the take, for the head of each camera's stream; empty: none
};

// How a take ended: what its last records say.
struct TakeEnd {
  TakeOutcome outcome = TakeOutcome::kComplete;
  std::string cause;
  int64_t ended_host_time_ns = 0;
  uint64_t sets_recorded = 0;
  uint64_t sets_dropped = 0;
  uint64_t frames_missing = 0;
};

// Thread safety: different streams may be appended to at once, with Commit beside them; the rest one at a
// time.
class TakeWriter {
 public:
  // Makes the folder, or takes an empty one, and locks it against other writers. AlreadyExists: the folder
  // holds a take. InvalidArgument: no camera, two of one id, an id that is no file name.
  static absl::StatusOr<std::unique_ptr<TakeWriter>> Create(const std::string& folder,
                                                            const std::vector<std::string>& camera_ids,
                                                            const TakeWriterOptions& options);

  const std::vector<std::string>& camera_ids() const { return camera_ids_; }
  // Appends the camera's part of a set: its frame, or why it has none.
  absl::Status Append(size_t camera, const RawFrameSet& set);

  // Everything up to `last_set` is on the disk, then the ledger says so. Sets that stand in `entries` as
  // recorded are acknowledged when this returns OK. Without `last_set`, the ledger alone.
  absl::Status Commit(std::optional<uint64_t> last_set, const std::vector<LedgerEntry>& entries);

  // Gives back what is reserved ahead of the streams, which may be what the disk lacks.
  absl::Status Trim();

  // Cuts the streams after `last_set` (the last one acknowledged), writes the last entries, then how the take
  // ended at the end of ledger and streams. Tries all of it and answers the first error; the end is written
  // where there was none.
  absl::Status Close(std::optional<uint64_t> last_set, const std::vector<LedgerEntry>& entries,
                     const TakeEnd& end);

  // Bytes of the disk below the take that are free, or reserved for its streams and not used.
  absl::StatusOr<uint64_t> FreeBytes() const;

 private:
  TakeWriter(PosixFile ledger, std::vector<std::string> camera_ids)
      : ledger_(std::move(ledger)), camera_ids_(std::move(camera_ids)) {}
  // The names of all files are on the disk.
  absl::Status SyncFolders(const std::string& folder) const;
  absl::Status AppendToLedger(const std::vector<LedgerEntry>& entries);

  PosixFile ledger_;
  uint64_t ledger_bytes_ = 0;
  uint64_t ledger_checksum_ = 0;  // of its last line
  const std::vector<std::string> camera_ids_;
  std::vector<std::unique_ptr<StreamWriter>> streams_;
};

// Locks the take's ledger for writing for as long as the file is open. FailedPrecondition: another process
// holds it.
absl::StatusOr<PosixFile> OpenLockedLedger(const std::string& take, int flags);

// The ledger's last entry.
LedgerEntry EndEntry(const TakeEnd& end, std::optional<uint64_t> last_set);

// The ledger's entries of a set that is on the disk: recorded, and a line for each camera without a frame.
std::vector<LedgerEntry> EntriesOfRecorded(const RawFrameSet& set, int64_t host_time_ns);

}  // namespace weft
