#include "capture/recover_take.h"

#include <fcntl.h>
#include <stdio.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <optional>
#include <set>

#include "absl/strings/str_cat.h"
#include "capture/ledger.h"
#include "capture/recorded_take.h"
#include "capture/take_files.h"
#include "capture/take_writer.h"

namespace weft {
namespace {

struct ScannedStream {
  std::string camera_id;
  std::unique_ptr<StreamReader> reader;
  StreamScan scan;
};

absl::StatusOr<std::vector<ScannedStream>> ScanStreams(const std::string& folder) {
  const absl::StatusOr<std::vector<std::string>> ids = CamerasOfTake(folder);
  if (!ids.ok()) return ids.status();
  std::vector<ScannedStream> streams;
  for (const std::string& id : *ids) {
    absl::StatusOr<std::unique_ptr<StreamReader>> reader = StreamReader::Open(StreamFolder(folder), id);
    if (!reader.ok()) return reader.status();
    absl::StatusOr<StreamScan> scan = (*reader)->Scan();
    if (!scan.ok()) return scan.status();
    streams.push_back({id, *std::move(reader), *std::move(scan)});
  }
  return streams;
}

// The last set that every stream has reached; empty where one has none.
std::optional<uint64_t> LastCommonSet(const std::vector<ScannedStream>& streams) {
  std::optional<uint64_t> last;
  for (const ScannedStream& stream : streams) {
    if (stream.scan.records.empty()) return std::nullopt;
    const uint64_t own = stream.scan.records.back().set;
    last = last ? std::min(*last, own) : own;
  }
  return last;
}

std::set<uint64_t> SetsOf(const std::vector<ScannedStream>& streams) {
  std::set<uint64_t> sets;
  for (const ScannedStream& stream : streams)
    for (const IndexRecord& record : stream.scan.records) sets.insert(record.set);
  return sets;
}

std::string Place(const ScannedStream& stream, uint64_t offset_bytes) {
  return absl::StrCat("camera ", stream.camera_id, ", byte ", offset_bytes, ": ");
}

absl::StatusOr<std::string> ReadAll(const PosixFile& file) {
  const absl::StatusOr<uint64_t> size = file.Size();
  if (!size.ok()) return size.status();
  std::string bytes(*size, '\0');
  if (absl::Status status = file.ReadAt(bytes.data(), bytes.size(), 0); !status.ok()) return status;
  return bytes;
}

void CheckStream(const ScannedStream& stream, TakeCheck& check) {
  for (const StreamDamage& damage : stream.scan.damage)
    check.problems.push_back(Place(stream, damage.offset_bytes) + damage.what);
  if (!stream.reader->index_damage().empty()) check.problems.push_back(stream.reader->index_damage());
  if (stream.scan.file_bytes > stream.scan.end_bytes) {
    check.problems.push_back(absl::StrCat(Place(stream, stream.scan.end_bytes),
                                          stream.scan.file_bytes - stream.scan.end_bytes,
                                          " bytes follow the last frame"));
  }
  const std::vector<IndexRecord>& indexed = stream.reader->records();
  std::set<uint64_t> found;
  for (const IndexRecord& record : stream.scan.records) {
    const bool is_indexed = std::binary_search(indexed.begin(), indexed.end(), record,
                                               [](const auto& a, const auto& b) { return a.set < b.set; });
    check.unindexed += !is_indexed;
    check.missing += record.is_missing;
    check.frames += !record.is_missing;
    found.insert(record.set);
  }
  for (const IndexRecord& record : indexed) {
    if (!found.contains(record.set)) {
      check.problems.push_back(absl::StrCat(Place(stream, record.offset_bytes), "set ", record.set,
                                            " stands in the index, but its frame is not intact"));
    }
  }
  check.bytes += stream.scan.file_bytes;
}

void CheckSets(const std::vector<ScannedStream>& streams, const std::vector<LedgerEntry>& ledger,
               TakeCheck& check) {
  const std::set<uint64_t> all = SetsOf(streams);
  std::set<uint64_t> recorded;
  for (const LedgerEntry& entry : ledger) {
    if (entry.event == LedgerEvent::kRecorded) recorded.insert(entry.first_set);
    if (entry.event == LedgerEvent::kDropped) check.dropped += entry.last_set - entry.first_set + 1;
  }
  std::vector<std::set<uint64_t>> of_stream;
  for (const ScannedStream& stream : streams) {
    std::set<uint64_t>& own = of_stream.emplace_back();
    for (const IndexRecord& record : stream.scan.records) own.insert(record.set);
  }
  for (const uint64_t set : all) {
    bool complete = true;
    for (size_t i = 0; i < streams.size(); ++i) {
      if (of_stream[i].contains(set)) continue;
      complete = false;
      check.problems.push_back(
          absl::StrCat("set ", set, ": camera ", streams[i].camera_id, " does not account for it"));
    }
    check.sets += complete;
    if (!recorded.contains(set))
      check.problems.push_back(absl::StrCat("set ", set, ": is in the streams, but not in the ledger"));
  }
  for (const uint64_t set : recorded)
    if (!all.contains(set))
      check.problems.push_back(absl::StrCat("set ", set, ": is in the ledger, but in no stream"));
}

// A new index under the old name. The old one stays where this fails.
absl::Status WriteIndex(const std::string& path, uint64_t take, const std::vector<IndexRecord>& records) {
  std::string bytes = IndexHeader(take);
  for (const IndexRecord& record : records) AppendTo(bytes, record);
  const std::string temporary = path + ".tmp";
  {
    absl::StatusOr<PosixFile> file = PosixFile::Open(temporary, O_RDWR | O_CREAT | O_TRUNC);
    if (!file.ok()) return file.status();
    if (absl::Status status = file->WriteAt(bytes.data(), bytes.size(), 0); !status.ok()) return status;
    if (absl::Status status = file->SyncData(); !status.ok()) return status;
  }
  if (rename(temporary.c_str(), path.c_str()) != 0) return FileError(path, "cannot be replaced", errno);
  return absl::OkStatus();
}

absl::Status RecoverStream(const std::string& folder, const ScannedStream& stream,
                           std::optional<uint64_t> last_set, TakeRecovery& recovery) {
  std::vector<IndexRecord> kept;
  uint64_t end_bytes = kBlockBytes;
  for (const IndexRecord& record : stream.scan.records) {
    if (!last_set || record.set > *last_set) {
      ++recovery.cut_off;
      continue;
    }
    kept.push_back(record);
    end_bytes = record.offset_bytes + kBlockBytes + PaddedBytes(record.payload_bytes);
  }
  for (const StreamDamage& damage : stream.scan.damage)
    if (damage.offset_bytes < end_bytes)
      recovery.damage.push_back(Place(stream, damage.offset_bytes) + damage.what);
  if (kept != stream.reader->records() || !stream.reader->index_damage().empty()) {
    const std::string index = IndexFile(StreamFolder(folder), stream.camera_id);
    if (absl::Status status = WriteIndex(index, stream.reader->header().take, kept); !status.ok())
      return status;
  }
  if (stream.scan.file_bytes == end_bytes) return absl::OkStatus();
  absl::StatusOr<PosixFile> file =
      PosixFile::Open(StreamFile(StreamFolder(folder), stream.camera_id), O_RDWR);
  if (!file.ok()) return file.status();
  if (absl::Status status = file->Truncate(end_bytes); !status.ok()) return status;
  return file->SyncData();
}

// Lines for sets that are in the streams up to `last_set`, but not in the ledger.
absl::StatusOr<std::string> MissingLines(const std::vector<ScannedStream>& streams,
                                         std::optional<uint64_t> last_set,
                                         const std::vector<LedgerEntry>& entries, uint64_t& count) {
  std::set<uint64_t> known;
  for (const LedgerEntry& entry : entries)
    if (entry.event == LedgerEvent::kRecorded) known.insert(entry.first_set);
  std::string lines;
  for (const uint64_t number : SetsOf(streams)) {
    if (!last_set || number > *last_set || known.contains(number)) continue;
    RawFrameSet set;
    set.number = number;
    for (const ScannedStream& stream : streams) {
      const auto& records = stream.scan.records;
      const auto at = std::lower_bound(records.begin(), records.end(), number,
                                       [](const IndexRecord& r, uint64_t n) { return r.set < n; });
      if (at == records.end() || at->set != number) {
        set.missing.push_back({stream.camera_id, "lost: damaged in the stream"});
        continue;
      }
      set.device_time_ns = at->device_time_ns;
      if (!at->is_missing) continue;
      const absl::StatusOr<ChunkHeader> header = stream.reader->ReadHeader(*at);
      if (!header.ok()) return header.status();
      set.missing.push_back({stream.camera_id, header->reason});
    }
    for (const LedgerEntry& entry : EntriesOfRecorded(set, 0)) lines += ToCsvLine(entry), ++count;
  }
  return lines;
}

}  // namespace

absl::StatusOr<TakeCheck> VerifyTake(const std::string& folder) {
  const absl::StatusOr<std::vector<ScannedStream>> streams = ScanStreams(folder);
  if (!streams.ok()) return streams.status();
  TakeCheck check;
  for (const ScannedStream& stream : *streams) CheckStream(stream, check);
  absl::StatusOr<ParsedLedger> ledger = ParsedLedger{};
  const absl::StatusOr<PosixFile> file = PosixFile::Open(LedgerFile(folder), O_RDONLY);
  const absl::StatusOr<std::string> text =
      file.ok() ? ReadAll(*file) : absl::StatusOr<std::string>(file.status());
  ledger = text.ok() ? ParseLedger(*text) : absl::StatusOr<ParsedLedger>(text.status());
  if (!ledger.ok()) {
    check.problems.push_back(absl::StrCat("ledger.csv: ", ledger.status().message()));
    ledger = ParsedLedger{};
  }
  if (!ledger->damage.empty()) check.problems.push_back(absl::StrCat("ledger.csv: ", ledger->damage));
  CheckSets(*streams, ledger->entries, check);
  if (check.unindexed > 0) {
    check.problems.push_back(
        absl::StrCat(check.unindexed, " intact frames are not in the index; run `weft take recover`"));
  }
  return check;
}

absl::StatusOr<TakeRecovery> RecoverTake(const std::string& folder) {
  if (!IsRecordedTake(folder)) return absl::NotFoundError(absl::StrCat(folder, ": no recorded take"));
  absl::StatusOr<PosixFile> ledger = OpenLockedLedger(folder, O_RDWR | O_CREAT);
  if (!ledger.ok()) return ledger.status();
  const absl::StatusOr<std::vector<ScannedStream>> streams = ScanStreams(folder);
  if (!streams.ok()) return streams.status();
  const std::optional<uint64_t> last_set = LastCommonSet(*streams);
  TakeRecovery recovery;
  std::set<uint64_t> indexed;
  for (const ScannedStream& stream : *streams) {
    for (const IndexRecord& record : stream.reader->records()) indexed.insert(record.set);
    if (absl::Status status = RecoverStream(folder, stream, last_set, recovery); !status.ok()) return status;
  }
  for (const uint64_t set : SetsOf(*streams)) {
    if (!last_set || set > *last_set) continue;
    ++recovery.sets;
    recovery.brought_back += !indexed.contains(set);
  }

  const absl::StatusOr<std::string> text = ReadAll(*ledger);
  if (!text.ok()) return text.status();
  absl::StatusOr<ParsedLedger> parsed = ParseLedger(*text);
  const bool has_heading = parsed.ok();
  if (!has_heading) parsed = ParsedLedger{};
  absl::StatusOr<std::string> lines =
      MissingLines(*streams, last_set, parsed->entries, recovery.entries_added);
  if (!lines.ok()) return lines.status();
  if (!has_heading) *lines = LedgerHeading() + *lines;
  if (absl::Status status = ledger->Truncate(parsed->intact_bytes); !status.ok()) return status;
  if (absl::Status status = ledger->WriteAt(lines->data(), lines->size(), parsed->intact_bytes); !status.ok())
    return status;
  if (absl::Status status = ledger->SyncData(); !status.ok()) return status;
  return recovery;
}

}  // namespace weft
