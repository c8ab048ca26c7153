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
  kEnd,   // the take was closed: last_set is its last one, the cause says how it ended
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

// "event,first_set,last_set,device_time_ns,host_time_ns,camera,cause,checksum" and a line feed.
std::string LedgerHeading();
std::string NameOf(LedgerEvent event);  // as the first column says it
// Each line ends with a checksum over that of the line before it and its own bytes: `before` is that of the
// line before and becomes its own. Line breaks inside the cause become spaces.
uint64_t LedgerStart();  // before the first line
std::string ToCsvLine(const LedgerEntry& entry, uint64_t& before);

// What the lines before tell of the next one's checksum: it covers what was printed, and what was meant.
struct LedgerChain {
  uint64_t printed = LedgerStart();
  uint64_t computed = LedgerStart();
};

struct ParsedLedger {
  std::vector<LedgerEntry> entries;  // of all lines that are intact
  bool has_checksums = true;         // false: made by an earlier version, without the last column
  std::string damage;                // the first damaged place, in words; empty where there is none
  size_t damaged_lines = 0;
  uint64_t checksum = 0;  // of the last line, where nothing is damaged
};
// Lines that are damaged are left out; those after them are read. InvalidArgument: not even the heading.
absl::StatusOr<ParsedLedger> ParseLedger(std::string_view csv);

// A ledger that grows: what has been read is not read again.
class LedgerTail {
 public:
  // Whole lines that follow those of earlier calls, the first of them the heading. Returns those that are
  // intact.
  std::vector<LedgerEntry> Add(std::string_view lines);
  // Of all lines, how many were not.
  size_t damaged_lines() const { return damaged_lines_; }

 private:
  enum class Columns { kUnknown, kSealed, kOld } columns_ = Columns::kUnknown;
  LedgerChain chain_;
  size_t damaged_lines_ = 0;
};

}  // namespace weft
