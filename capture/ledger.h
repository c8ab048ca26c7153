// The ledger of a take: what became of every frame set, and why.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

enum class LedgerEvent {
  kRecorded,  // the set is on the disk; cameras that lack a frame follow as kMissing
  kMissing,   // this camera has no frame in the set
  kDropped,   // the sets first_set to last_set are not in the take
  kNote,  // something happened: a camera was lost, a clock jumped, the disk was slow, the recorder stopped
};

// One line. Times are 0 where they do not apply.
struct LedgerEntry {
  LedgerEvent event = LedgerEvent::kNote;
  uint64_t first_set = 0;
  uint64_t last_set = 0;
  int64_t device_time_ns = 0;  // of the first set
  int64_t host_time_ns = 0;    // CLOCK_REALTIME, when it was noticed
  std::string camera_id;       // empty: all
  std::string cause;           // in words

  bool operator==(const LedgerEntry&) const = default;
};

// "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause" and a line feed.
std::string LedgerHeading();
// A line of CSV; line breaks inside the cause become spaces.
std::string ToCsvLine(const LedgerEntry& entry);

struct ParsedLedger {
  std::vector<LedgerEntry> entries;
  uint64_t intact_bytes = 0;  // what follows was cut off by a crash or is damaged
  std::string damage;         // in words; empty where the ledger ends as it should
};
// Reads up to the first line that is not whole. InvalidArgument: not even the heading.
absl::StatusOr<ParsedLedger> ParseLedger(std::string_view csv);

}  // namespace weft
