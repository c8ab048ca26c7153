#include "capture/take/check_take.h"

#include <fcntl.h>

#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/sync/ledger.h"
#include "capture/take/take_files.h"
#include "capture/take/take_scan.h"

namespace weft {
namespace {

std::string Place(const ScannedStream& stream, uint64_t offset_bytes) {
  return absl::StrCat("camera ", stream.camera_id, ", byte ", offset_bytes, ": ");
}

void CheckPadding(const std::string& path, const std::vector<uint64_t>& stray_bytes, TakeCheck& check) {
  if (stray_bytes.empty()) return;
  const size_t more = stray_bytes.size() - 1;
  check.warnings.push_back(absl::StrCat(
      path, ": byte ", stray_bytes.front(), ": padding is not zero",
      more > 0 ? absl::StrCat(", and in ", more, more == 1 ? " place" : " places", " after it") : "",
      "; no frame is harmed"));
}

void CheckFile(const ScannedStream& stream, uint64_t take, TakeCheck& check) {
  const std::string camera = absl::StrCat("camera ", stream.camera_id, ": ");
  if (!stream.file_damage().empty()) check.problems.push_back(camera + stream.file_damage());
  if (!stream.reader) return;
  check.cameras.push_back(stream.camera_id);
  const StreamReader& reader = *stream.reader;
  const StreamScan& scan = stream.scan;
  check.bytes += scan.file_bytes;
  if (reader.header().take != take) check.problems.push_back(camera + "its stream is of another take");
  for (const StreamDamage& damage : scan.damage)
    check.problems.push_back(Place(stream, damage.offset_bytes) + damage.what);
  if (!reader.index_damage().empty()) check.problems.push_back(reader.index_damage());
  const uint64_t end_bytes = scan.end_bytes + (scan.end ? kBlockBytes : 0);
  if (scan.file_bytes > end_bytes) {
    check.problems.push_back(
        absl::StrCat(Place(stream, end_bytes), scan.file_bytes - end_bytes, " bytes follow the last frame"));
  }
  if (reader.header().version == 1 || !reader.header_damage().empty()) return;
  check.has_ends = true;
  if (!scan.end) {
    check.problems.push_back(camera + "its stream has no end record: it was cut, or the take was not closed");
  } else if (scan.end->chunks != scan.records.size()) {
    check.problems.push_back(absl::StrCat(camera, "its end record counts ", scan.end->chunks,
                                          " chunks, the stream holds ", scan.records.size(), " intact ones"));
  }
  if (scan.end) check.end = scan.end;
}

void CheckSetsOfStream(const ScannedStream& stream, const std::map<uint64_t, int64_t>& sets,
                       const SetLedger& ledger, TakeCheck& check) {
  std::vector<uint64_t> gone, untold;
  for (const auto& [set, time_ns] : sets) {
    const IndexRecord* record = stream.Intact(set);
    if (record == nullptr) {
      gone.push_back(set);
      continue;
    }
    check.unindexed += stream.Indexed(set) == nullptr;
    check.missing += record->is_missing;
    check.frames += !record->is_missing;
    if (record->is_missing && !ledger.missing.contains({set, stream.camera_id})) untold.push_back(set);
  }
  if (!gone.empty()) {
    check.problems.push_back(absl::StrCat("camera ", stream.camera_id, ": ", gone.size(),
                                          gone.size() == 1 ? " frame is" : " frames are", " gone, of set ",
                                          RangesText(gone)));
  }
  if (!untold.empty()) {
    check.problems.push_back(absl::StrCat("camera ", stream.camera_id,
                                          ": the ledger does not say why frames are missing in set ",
                                          RangesText(untold)));
  }
}

void CheckSets(const std::vector<ScannedStream>& streams, const SetLedger& ledger, TakeCheck& check) {
  const std::map<uint64_t, int64_t> sets = SetsOf(streams, ledger);
  check.recorded = sets.size();
  check.dropped = CountDropped(ledger, sets);
  for (const ScannedStream& stream : streams) CheckSetsOfStream(stream, sets, ledger, check);
  std::vector<uint64_t> unknown, nowhere;
  for (const auto& [set, time_ns] : sets) {
    size_t accounted = 0, frames = 0;
    for (const ScannedStream& stream : streams) {
      const IndexRecord* record = stream.Intact(set);
      accounted += record != nullptr;
      frames += record != nullptr && !record->is_missing;
    }
    check.sets += accounted == streams.size();
    check.complete_sets += frames == streams.size();
    if (accounted > 0 && !ledger.recorded.contains(set)) unknown.push_back(set);
    if (accounted == 0) nowhere.push_back(set);
  }
  if (!unknown.empty())
    check.problems.push_back(
        absl::StrCat("set ", RangesText(unknown), ": in the streams, but not in the ledger"));
  if (!nowhere.empty())
    check.problems.push_back(
        absl::StrCat("set ", RangesText(nowhere), ": is in the ledger, but in no stream"));
}

absl::StatusOr<ParsedLedger> ReadLedger(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const PosixFile file, PosixFile::Open(LedgerFile(folder), O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(const std::string text, file.ReadAll());
  return ParseLedger(text);
}

}  // namespace

absl::StatusOr<TakeCheck> VerifyTake(const std::string& folder, const std::vector<std::string>& cameras,
                                     uint64_t take) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<ScannedStream> streams, ScanStreams(folder, cameras, take));
  TakeCheck check;
  check.take = TakeOf(streams);
  for (const ScannedStream& stream : streams) {
    CheckFile(stream, check.take, check);
    CheckPadding(StreamFile(StreamFolder(folder), stream.camera_id), stream.scan.stray_bytes, check);
  }
  absl::StatusOr<ParsedLedger> ledger = ReadLedger(folder);
  if (!ledger.ok()) {
    check.problems.push_back(absl::StrCat("ledger.csv: ", ledger.status().message()));
    ledger = ParsedLedger{};
  } else if (!ledger->damage.empty()) {
    check.problems.push_back(absl::StrCat("ledger.csv: ", ledger->damage, ", ", ledger->damaged_lines,
                                          " in all; its other lines were read"));
  } else if (check.has_ends && !ledger->has_checksums) {
    check.problems.push_back(
        "ledger.csv: has no checksums, though its streams are of a version that has them");
  }
  const SetLedger summary = SummaryOf(ledger->entries);
  if (check.end && ledger->has_checksums && !summary.has_end)
    check.problems.push_back("ledger.csv: has no end record: it was cut, or the take was not closed");
  CheckSets(streams, summary, check);
  if (check.unindexed > 0) {
    check.problems.push_back(
        absl::StrCat(check.unindexed, " intact frames are not in the index; run `weft take recover`"));
  }
  return check;
}

}  // namespace weft
