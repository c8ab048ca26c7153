// How far the recording of a take is, by its ledger alone.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/sync/ledger.h"

namespace weft {

struct RecordedSet {
  uint64_t number = 0;
  int64_t host_time_ns = 0;    // CLOCK_REALTIME, when the recorder noticed it
  int64_t device_time_ns = 0;  // by the cameras' common clock; 0 where there is none
};

struct TakeProgress {
  std::vector<RecordedSet> sets;  // those on the disk, in order
  bool closed = false;            // no set will follow
};

// Also while another process records the take. NotFound: the folder holds no recorded take. Otherwise errors
// of the disk.
absl::StatusOr<TakeProgress> ReadTakeProgress(const std::string& folder);

// Reads what is new in the ledger of a take that may be growing. Thread safety: none.
class LedgerReader {
 public:
  explicit LedgerReader(std::string take_folder) : take_folder_(std::move(take_folder)) {}

  struct News {
    std::vector<LedgerEntry> entries;
    bool from_start = false;  // lines that were read have changed since: these are all
  };
  // Errors of ReadTakeProgress. What an error kept from being read comes with the next call.
  absl::StatusOr<News> ReadNew();

 private:
  const std::string take_folder_;
  uint64_t offset_bytes_ = 0;
  LedgerTail tail_;
};

// The same as ReadTakeProgress each time, for the cost of what is new. Thread safety: none.
class TakeFollower {
 public:
  explicit TakeFollower(std::string take_folder) : ledger_(std::move(take_folder)) {}

  // Valid until the next call.
  absl::StatusOr<const TakeProgress*> Poll();

 private:
  LedgerReader ledger_;
  TakeProgress progress_;
};

}  // namespace weft
