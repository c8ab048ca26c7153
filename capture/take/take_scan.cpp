#include "capture/take/take_scan.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

const IndexRecord* Find(const std::vector<IndexRecord>& records, uint64_t set) {
  const auto at = std::lower_bound(records.begin(), records.end(), set,
                                   [](const IndexRecord& r, uint64_t n) { return r.set < n; });
  return at != records.end() && at->set == set ? &*at : nullptr;
}

}  // namespace

absl::StatusOr<std::vector<std::string>> CamerasWithFiles(const std::string& folder,
                                                          const std::vector<std::string>& known) {
  std::set<std::string> ids(known.begin(), known.end());
  std::error_code error;
  fs::directory_iterator it(StreamFolder(folder), error);
  if (error) return absl::NotFoundError(absl::StrCat(folder, ": no recorded take, it has no folder streams"));
  for (const fs::directory_iterator end; !error && it != end; it.increment(error)) {
    const std::string kind = it->path().extension().string();
    if (kind == ".stream" || kind == ".index") ids.insert(it->path().stem().string());
  }
  if (error)
    return absl::UnavailableError(absl::StrCat(folder, "/streams: cannot be listed (", error.message(), ")"));
  if (ids.empty()) return absl::NotFoundError(absl::StrCat(folder, "/streams: holds no stream"));
  std::vector<std::string> sorted(ids.begin(), ids.end());
  std::sort(sorted.begin(), sorted.end(), NaturalLess);
  return sorted;
}

const IndexRecord* ScannedStream::Indexed(uint64_t set) const {
  return reader ? Find(reader->records(), set) : nullptr;
}

const IndexRecord* ScannedStream::Intact(uint64_t set) const { return Find(scan.records, set); }

uint64_t TakeOf(const std::vector<ScannedStream>& streams) {
  std::map<uint64_t, int> votes;
  uint64_t best = 0;
  for (const ScannedStream& stream : streams) {
    if (!stream.reader || stream.reader->header().take == 0) continue;
    const uint64_t take = stream.reader->header().take;
    if (++votes[take] > votes[best]) best = take;
  }
  return best;
}

absl::StatusOr<std::vector<ScannedStream>> ScanStreams(const std::string& folder,
                                                       const std::vector<std::string>& cameras,
                                                       uint64_t take) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> ids, CamerasWithFiles(folder, cameras));
  std::vector<ScannedStream> streams;
  for (const std::string& id : ids) {
    ScannedStream& stream = streams.emplace_back();
    stream.camera_id = id;
    auto reader = StreamReader::OpenDamaged(StreamFolder(folder), id, take);
    if (absl::IsNotFound(reader.status())) continue;
    if (!reader.ok()) return reader.status();
    stream.reader = *std::move(reader);
  }
  const uint64_t number = TakeOf(streams);
  for (ScannedStream& stream : streams) {
    if (!stream.reader) continue;
    if (!stream.reader->header_damage().empty() && stream.reader->header().take != number) {
      WEFT_ASSIGN_OR_RETURN(auto again,
                            StreamReader::OpenDamaged(StreamFolder(folder), stream.camera_id, number));
      stream.reader = std::move(again);
    }
    WEFT_ASSIGN_OR_RETURN(StreamScan scan, stream.reader->Scan());
    stream.scan = std::move(scan);
  }
  return streams;
}

SetLedger SummaryOf(const std::vector<LedgerEntry>& entries) {
  SetLedger ledger;
  for (const LedgerEntry& entry : entries) {
    if (entry.event == LedgerEvent::kRecorded) ledger.recorded[entry.first_set] = entry.device_time_ns;
    if (entry.event == LedgerEvent::kMissing)
      ledger.missing[{entry.first_set, entry.camera_id}] = entry.cause;
    if (entry.event == LedgerEvent::kDropped) ledger.dropped.push_back(entry);
    ledger.has_end = entry.event == LedgerEvent::kEnd;
  }
  return ledger;
}

std::map<uint64_t, int64_t> SetsOf(const std::vector<ScannedStream>& streams, const SetLedger& ledger) {
  std::map<uint64_t, int64_t> sets = ledger.recorded;
  for (const ScannedStream& stream : streams) {
    for (const IndexRecord& record : stream.scan.records) sets.try_emplace(record.set, record.device_time_ns);
    if (!stream.reader) continue;
    for (const IndexRecord& record : stream.reader->records())
      sets.try_emplace(record.set, record.device_time_ns);
  }
  return sets;
}

uint64_t CountDropped(const SetLedger& ledger, const std::map<uint64_t, int64_t>& sets) {
  uint64_t dropped = 0;
  for (const LedgerEntry& entry : ledger.dropped) {
    dropped += entry.last_set - entry.first_set + 1;
    for (auto at = sets.lower_bound(entry.first_set); at != sets.end() && at->first <= entry.last_set; ++at)
      --dropped;
  }
  return dropped;
}

std::string RangesText(const std::vector<uint64_t>& numbers) {
  std::string text;
  for (size_t i = 0; i < numbers.size();) {
    size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    absl::StrAppend(&text, text.empty() ? "" : ", ", numbers[i]);
    if (last > i) absl::StrAppend(&text, last == i + 1 ? ", " : " to ", numbers[last]);
    i = last + 1;
  }
  return text;
}

}  // namespace weft
