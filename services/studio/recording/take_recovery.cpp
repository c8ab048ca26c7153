#include "services/studio/recording/take_recovery.h"

#include <fcntl.h>

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/take/check_take.h"
#include "capture/take/recover_take.h"
#include "capture/take/take_files.h"
#include "capture/take/take_writer.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/studio/recording/clock_log.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_verdict.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> IdsOf(const v1::Take& take) {
  std::vector<std::string> ids;
  for (const v1::TakeCamera& camera : take.cameras()) ids.push_back(camera.id());
  return ids;
}

// take.json, or what the streams say where it is damaged or gone.
struct KnownTake {
  v1::Take take;
  absl::Status file;  // OK: take.json is whole
  bool has_checksum = false;
};

absl::StatusOr<KnownTake> ReadKnown(const std::string& folder) {
  absl::StatusOr<TakeFile> file = ReadTakeFileStrictly(folder);
  if (file.ok()) return KnownTake{std::move(file->take), absl::OkStatus(), file->has_checksum};
  if (!absl::IsNotFound(file.status()) && !absl::IsDataLoss(file.status()) &&
      !absl::IsInvalidArgument(file.status()))
    return file.status();
  absl::StatusOr<v1::Take> take = TakeFromStreams(folder);
  // Streams that are gone altogether still leave their indexes.
  if (!take.ok() && !IsRecordedTake(folder)) return take.status();
  return KnownTake{take.value_or(v1::Take()), file.status(), false};
}

// Closed by a recorder: take.json says so, and not every stream of this version lacks its end record.
bool IsClosed(const std::string& folder, const v1::Take& take) {
  if (take.state() == v1::TAKE_STATE_RECORDING || take.state() == v1::TAKE_STATE_UNSPECIFIED) return false;
  const absl::StatusOr<std::vector<std::string>> ids = CamerasOfTake(folder);
  if (!ids.ok()) return true;
  for (const std::string& id : *ids) {
    const auto stream = StreamReader::OpenDamaged(StreamFolder(folder), id, 0);
    if (!stream.ok() || !(*stream)->header_damage().empty() || (*stream)->header().version == 1 ||
        (*stream)->end())
      return true;
  }
  return false;
}

void CheckTotals(const v1::Take& take, const TakeCheck& check, v1::TakeCheckReport& report) {
  const auto compare = [&](const char* what, uint64_t said, uint64_t found) {
    if (said != found)
      report.add_problems(absl::StrCat("take.json: says ", said, " ", what, ", the take has ", found));
  };
  compare("frame sets recorded", take.sets_recorded(), check.recorded);
  compare("frame sets dropped", take.sets_dropped(), check.dropped);
  compare("frames missing", take.frames_missing(), check.missing);
}

void CheckTakeFile(const KnownTake& known, const TakeCheck& check, v1::TakeCheckReport& report) {
  if (!known.file.ok()) {
    report.add_problems(std::string(known.file.message()));
    return;
  }
  const v1::Take& take = known.take;
  if (check.has_ends && !known.has_checksum)
    report.add_problems("take.json: has no checksum, though its streams are of a version that has one");
  if (TakeNumber(take) != check.take)
    report.add_problems(absl::StrCat("take.json: is of take ", take.id(), ", the streams are of another"));
  const std::vector<std::string> ids = IdsOf(take);
  for (const std::string& id : check.cameras)
    if (std::ranges::find(ids, id) == ids.end())
      report.add_problems(absl::StrCat("camera ", id, ": has a stream, and take.json does not name it"));
  if (take.state() == v1::TAKE_STATE_RECORDING || take.state() == v1::TAKE_STATE_UNSPECIFIED) {
    report.add_problems(IsBeingRecorded(report.take())
                            ? "the take is being recorded"
                            : "take.json: the take was not closed: its recorder ended in the middle");
  } else if (known.has_checksum && report.problems().empty()) {
    CheckTotals(take, check, report);
  }
}

// Takes of cameras have a log of their clocks; copies of them as well.
void CheckClockLog(const std::string& folder, const v1::Take& take, bool is_closed,
                   v1::TakeCheckReport& report) {
  const std::string damage = ReadClockLog(folder, {take.clocks_checksum(), is_closed}).damage;
  if (!damage.empty()) report.add_problems(damage);
}

}  // namespace

absl::StatusOr<v1::TakeCheckReport> VerifyRecordedTake(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const KnownTake known, ReadKnown(folder));
  WEFT_ASSIGN_OR_RETURN(const TakeCheck check, VerifyTake(folder, IdsOf(known.take), TakeNumber(known.take)));
  v1::TakeCheckReport report;
  report.set_take(folder);
  for (const std::string& problem : check.problems) report.add_problems(problem);
  for (const std::string& warning : check.warnings) report.add_warnings(warning);
  CheckTakeFile(known, check, report);
  CheckClockLog(folder, known.take, IsClosed(folder, known.take), report);
  report.set_whole(report.problems().empty());
  report.set_sets(check.sets);
  report.set_complete_sets(check.complete_sets);
  report.set_frames(check.frames);
  report.set_missing(check.missing);
  report.set_dropped(check.dropped);
  report.set_unindexed(check.unindexed);
  report.set_bytes(check.bytes);
  AssessCheck(report, IsClosed(folder, known.take));
  return report;
}

namespace {

v1::TakeRecoveryReport ReportOf(const std::string& folder, const TakeRecovery& recovery, bool dry_run) {
  v1::TakeRecoveryReport report;
  report.set_take(folder);
  report.set_dry_run(dry_run);
  report.set_sets(recovery.sets);
  report.set_brought_back(recovery.brought_back);
  report.set_entries_added(recovery.entries_added);
  report.set_frames_lost(recovery.frames_lost);
  report.set_frames_unfinished(recovery.frames_unfinished);
  report.set_cut_bytes(recovery.cut_bytes);
  report.set_kept_aside(recovery.kept_aside);
  for (const std::string& damage : recovery.damage) report.add_damage(damage);
  for (const std::string& change : recovery.changes) report.add_changes(change);
  return report;
}

// Lines that are whole are kept, and the log gets its end; what it was is kept aside where lines are lost.
struct ClockRepair {
  std::string text;    // to be written; empty: the log stays as it is, or there is none
  std::string damage;  // empty: none
};

ClockRepair RepairOf(const std::string& folder, const v1::Take& take) {
  const absl::StatusOr<ParsedClockLog> log = ParseClockLog(folder);
  const bool is_lost = absl::IsNotFound(log.status()) ? !take.clocks_checksum().empty()
                                                      : log.ok() && !log->MayBeOf(take.clocks_checksum());
  if (is_lost) return {ClockLogText({}), ReadClockLog(folder, {take.clocks_checksum(), true}).damage};
  if (absl::IsDataLoss(log.status())) return {ClockLogText({}), std::string(log.status().message())};
  if (!log.ok() || (log->damaged_lines == 0 && (log->has_end || !log->has_checksums))) return {};
  // The last line of a recorder that was killed is no damage.
  const bool is_crash = log->is_cut && log->damaged_lines == 1;
  if (is_crash && !log->has_checksums) return {};
  return {ClockLogText(log->readings),
          is_crash || log->damaged_lines == 0
              ? ""
              : absl::StrCat("clocks.csv: ", log->damage, ", ", log->damaged_lines, " in all")};
}

// True where take.json has to be written.
bool Update(const KnownTake& known, const TakeRecovery& recovery, v1::Take& take) {
  const bool was_open =
      take.state() == v1::TAKE_STATE_RECORDING || take.state() == v1::TAKE_STATE_UNSPECIFIED;
  if (!was_open && recovery.changes.empty() && known.file.ok()) return false;
  if (was_open) take.set_stop_cause("the recorder ended without closing the take");
  if (take.ended_host_time_ns() == 0) take.set_ended_host_time_ns(recovery.ended_host_time_ns);
  take.set_state(v1::TAKE_STATE_RECOVERED);
  take.set_sets_recorded(recovery.sets);
  take.set_sets_dropped(recovery.dropped);
  take.set_frames_missing(recovery.frames_missing);
  take.set_frames_lost(take.frames_lost() + recovery.frames_lost);
  return true;
}

}  // namespace

absl::StatusOr<v1::TakeRecoveryReport> RecoverRecordedTake(const std::string& folder,
                                                           const TakeRecoveryChoice& choice) {
  WEFT_ASSIGN_OR_RETURN(const KnownTake known, ReadKnown(folder));
  if (!choice.force && !choice.dry_run && IsClosed(folder, known.take)) {
    return absl::FailedPreconditionError(absl::StrCat(
        folder,
        ": the take was closed, so nothing is left to recover of a crash; `weft take verify` says "
        "whether it is damaged, `weft take recover --force` puts gaps where frames are gone and keeps "
        "every intact frame, and with --dry-run only says so"));
  }
  TakeRecoveryOptions options;
  options.dry_run = choice.dry_run;
  options.cameras = IdsOf(known.take);
  options.take = TakeNumber(known.take);
  options.sets_dropped = known.take.sets_dropped();
  for (int i = 0; i < known.take.cameras_size(); ++i)
    options.descriptions[known.take.cameras(i).id()] = StreamDescription(known.take, i);
  if (!known.file.ok() && PathExists(TakeJsonFile(folder))) options.keep.push_back("take.json");
  const ClockRepair clocks = RepairOf(folder, known.take);
  if (!clocks.damage.empty() && PathExists(ClockLogFile(folder))) options.keep.push_back("clocks.csv");
  WEFT_ASSIGN_OR_RETURN(const TakeRecovery recovery, RecoverTake(folder, options));
  v1::TakeRecoveryReport report = ReportOf(folder, recovery, choice.dry_run);
  v1::Take take = known.take;
  if (!known.file.ok()) report.add_damage(std::string(known.file.message()));
  if (!clocks.damage.empty()) {
    report.add_damage(clocks.damage);
    report.add_changes("clocks.csv: has the readings that are whole");
  }
  if (!clocks.text.empty() && !choice.dry_run)
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(ClockLogFile(folder), clocks.text));
  const bool is_updated = Update(known, recovery, take);
  if (is_updated)
    report.add_changes("take.json: says that the take was recovered, with the totals of what it holds");
  if (!clocks.text.empty() && !choice.dry_run)
    take.set_clocks_checksum(ParseClockLog(folder).value_or(ParsedClockLog()).end_checksum);
  if ((is_updated || !clocks.text.empty()) && !choice.dry_run)
    WEFT_RETURN_IF_ERROR(WriteTakeFile(folder, take));
  AssessRecovery(report);
  if (report.kept_aside().empty()) return report;
  const std::string path = (fs::path(report.kept_aside()) / "recovery.json").string();
  WEFT_RETURN_IF_ERROR(WriteJsonFile(path, report));
  return report;
}

absl::StatusOr<uint64_t> PurgeRecovered(const std::string& folder) {
  if (!IsRecordedTake(folder)) return absl::NotFoundError(absl::StrCat(folder, ": no recorded take"));
  const absl::StatusOr<PosixFile> ledger = OpenLockedLedger(folder, O_RDONLY);
  if (absl::IsFailedPrecondition(ledger.status())) return ledger.status();
  const fs::path kept = fs::path(folder) / "recovered";
  uint64_t bytes = 0;
  std::error_code error;
  if (!fs::exists(kept, error)) return 0;
  for (fs::recursive_directory_iterator it(kept, error), end; !error && it != end; it.increment(error))
    if (it->is_regular_file(error)) bytes += it->file_size(error);
  if (!error) fs::remove_all(kept, error);
  if (error) return FileError(kept.string(), "cannot be removed", error.value());
  return bytes;
}

}  // namespace weft
