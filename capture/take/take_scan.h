// What the streams of a take really hold: the common ground of checking and repair.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/sync/ledger.h"
#include "capture/take/stream_reader.h"

namespace weft {

struct ScannedStream {
  std::string camera_id;
  std::unique_ptr<StreamReader> reader;  // null where the stream is gone
  StreamScan scan;

  // What is wrong with the file as a whole; empty where its header is intact.
  std::string file_damage() const { return reader ? reader->header_damage() : "the stream is gone"; }
  // Of the set, by its index; null where the index lacks it.
  const IndexRecord* Indexed(uint64_t set) const;
  // The same of what is intact in the stream.
  const IndexRecord* Intact(uint64_t set) const;
};

// Ids of the cameras of which the folder holds a stream or an index, and of `known`, numbers by value.
// NotFound: there are none.
absl::StatusOr<std::vector<std::string>> CamerasWithFiles(const std::string& folder,
                                                          const std::vector<std::string>& known = {});

// Reads every byte of the streams of CamerasWithFiles(folder, cameras). Errors of PosixFile but for files
// that are gone; NotFound: no recorded take. `take`: the take's number where it is known from elsewhere, else
// 0.
absl::StatusOr<std::vector<ScannedStream>> ScanStreams(const std::string& folder,
                                                       const std::vector<std::string>& cameras,
                                                       uint64_t take);

// The take's number: that of most streams.
uint64_t TakeOf(const std::vector<ScannedStream>& streams);

// What became of every set, from all that is known of it.
struct SetLedger {
  std::map<uint64_t, int64_t> recorded;                             // the ledger's: set and its device time
  std::map<std::pair<uint64_t, std::string>, std::string> missing;  // set and camera: the cause
  std::vector<LedgerEntry> dropped;
  bool has_end = false;  // the last line says how the take ended
};
SetLedger SummaryOf(const std::vector<LedgerEntry>& entries);

// Every set of which streams, indexes or ledger know that it was recorded, with its device time (0: unknown).
std::map<uint64_t, int64_t> SetsOf(const std::vector<ScannedStream>& streams, const SetLedger& ledger);

// Sets that the ledger says were dropped and that are in no stream.
uint64_t CountDropped(const SetLedger& ledger, const std::map<uint64_t, int64_t>& sets);

// "3 to 7, 9" for ascending numbers.
std::string RangesText(const std::vector<uint64_t>& numbers);

}  // namespace weft
