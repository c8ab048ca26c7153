#include "services/server/catalogue/restore.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/server/catalogue/catalogue_rows.h"
#include "services/server/catalogue/folder_sync.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMaxCredibleVersion = 1000;  // of a newer Weft; beyond it the number itself is damaged
// Copies that earlier versions kept, the newest first.
constexpr const char* kBackups[] = {".backup-1", ".backup-2", ".backup-3"};

struct Finding {
  std::unique_ptr<Database> database;  // null: there is none yet, or it cannot be opened
  std::string damage;                  // why the file is to be replaced; empty: it stays
  bool is_older = false;               // sound, of an older Weft
  std::set<std::string> settled;       // jobs whose row is whole, and whose record says no more
  absl::Status unkept;                 // records that could not be written
};

bool SaysMore(const v1::JobUpdate& row, const v1::JobUpdate& record) {
  if (EndOf(row.job()) != EndOf(record.job())) return EndOf(row.job()) > EndOf(record.job());
  // Only rows have the progress of a job that runs.
  return EndOf(row.job()) == 0 && row.frames_size() >= record.frames_size() &&
         row.SerializeAsString() != record.SerializeAsString();
}

absl::StatusOr<v1::JobUpdate> ReadWhole(Database& database, const JobRow& row, int64_t version) {
  v1::JobUpdate whole;
  WEFT_ASSIGN_OR_RETURN(*whole.mutable_job(), ReadRow(row, version));
  WEFT_ASSIGN_OR_RETURN(Statement frames,
                        database.Prepare(absl::StrCat("SELECT ", FrameColumns(version),
                                                      " FROM frames WHERE job_id = ? ORDER BY position")));
  frames.BindText(1, row.id);
  for (;;) {
    WEFT_ASSIGN_OR_RETURN(const bool is_there, frames.Step());
    if (!is_there) return whole;
    const FrameRow frame = FrameRowOf(frames);
    if (frame.position != whole.frames_size())
      return absl::DataLossError(absl::StrCat("job ", whole.job().id(), " lacks frames"));
    WEFT_ASSIGN_OR_RETURN(*whole.add_frames(), ReadRow(frame, version));
  }
}

// Writes the records that say less than the rows. DataLoss, Internal: not all rows can be read.
absl::Status KeepRows(Database& database, int64_t version, const JobRecords& records, Finding& finding) {
  WEFT_ASSIGN_OR_RETURN(Statement jobs, database.Prepare(absl::StrCat("SELECT ", JobColumns(version),
                                                                      " FROM jobs ORDER BY sequence")));
  absl::Status damage;
  for (;;) {
    const absl::StatusOr<bool> is_there = jobs.Step();
    if (!is_there.ok()) damage.Update(is_there.status());
    if (!is_there.ok() || !*is_there) return damage;
    absl::StatusOr<v1::JobUpdate> row = ReadWhole(database, JobRowOf(jobs), version);
    damage.Update(row.status());
    if (!row.ok()) continue;
    const absl::StatusOr<v1::JobUpdate> record = records.Read(row->job().id());
    // Of a job that has not ended records have the priority first: the row follows when the disk takes it.
    const bool is_moved = record.ok() && EndOf(row->job()) == 0 && EndOf(record->job()) == 0 &&
                          row->job().priority() != record->job().priority();
    if (is_moved) row->mutable_job()->set_priority(record->job().priority());
    if (!record.ok() || SaysMore(*row, *record)) finding.unkept.Update(records.Write(*row));
    if (!is_moved && (!record.ok() || EndOf(row->job()) >= EndOf(record->job())))
      finding.settled.insert(row->job().id());
  }
}

absl::Status ExamineContent(const JobRecords& records, Finding& finding) {
  Database& database = *finding.database;
  WEFT_ASSIGN_OR_RETURN(const int64_t version, database.ReadNumber("PRAGMA user_version"));
  if (version > kSchemaVersion && version < kMaxCredibleVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat(database.path(), ": written by a newer Weft (schema ", version, ", this one knows ",
                     kSchemaVersion, "); install that version, or give another --state folder"));
  }
  const absl::Status whole = database.CheckIntegrity();
  const absl::StatusOr<int64_t> tables = database.ReadNumber("SELECT count(*) FROM sqlite_schema");
  // SQLite's own crash while it made the file.
  if (whole.ok() && version == 0 && tables.ok() && *tables == 0) return absl::OkStatus();
  finding.is_older = version == kFirstSchemaVersion;
  const absl::Status rows = KeepRows(database, finding.is_older ? version : kSchemaVersion, records, finding);
  WEFT_RETURN_IF_ERROR(whole);
  if (version >= kFirstSchemaVersion && version <= kSchemaVersion) return rows;
  return absl::DataLossError(
      absl::StrCat(database.path(), ": damaged (the tables are gone, or their version is)"));
}

absl::StatusOr<Finding> Examine(const std::string& path, const JobRecords& records) {
  Finding finding;
  if (FileBytes(path) == 0) {
    if (FileBytes(path + "-wal") > 0 || !records.JobIds().empty())
      finding.damage = path + (PathExists(path) ? ": is empty" : ": is gone");
    return finding;
  }
  absl::StatusOr<std::unique_ptr<Database>> database = Database::Open(path);
  absl::Status status = database.status();
  if (status.ok()) {
    finding.database = *std::move(database);
    status = ExamineContent(records, finding);
  }
  if (absl::IsDataLoss(status) || absl::IsInternal(status)) {
    finding.damage = std::string(status.message());
    finding.is_older = false;
    return finding;
  }
  if (!status.ok()) return status;
  return finding;
}

// Never over another file. Returns the new name.
absl::StatusOr<std::string> SetAside(const std::string& path, const std::string& name) {
  const std::string base = absl::StrCat(path, ".", name, UtcFileName());
  std::string aside = base;
  for (int i = 2; PathExists(aside) || PathExists(aside + "-wal"); ++i) aside = absl::StrCat(base, ".", i);
  for (const char* ending : {"", "-wal", "-journal"}) {
    std::error_code error;
    if (!PathExists(path + ending)) continue;
    fs::rename(path + ending, aside + ending, error);
    if (error) {
      return absl::UnavailableError(
          absl::StrCat(path, ending, ": cannot be renamed to ", aside, ending, " (", error.message(), ")"));
    }
  }
  WEFT_RETURN_IF_ERROR(SyncFolderOf(path));
  return aside;
}

absl::Status Replace(const std::string& path, const JobRecords& records, Finding& finding,
                     std::vector<std::string>& warnings) {
  for (const char* ending : kBackups) {
    if (FileBytes(path + ending) == 0) continue;
    const absl::StatusOr<std::unique_ptr<Database>> backup = Database::Open(path + ending);
    if (backup.ok()) KeepRows(**backup, kSchemaVersion, records, finding).IgnoreError();
  }
  if (!finding.unkept.ok()) {
    return absl::Status(finding.unkept.code(),
                        absl::StrCat(path, ": damaged, and its jobs cannot be written down anew: ",
                                     absl::string_view(finding.unkept.message())));
  }
  finding.database.reset();
  finding.settled.clear();
  WEFT_ASSIGN_OR_RETURN(const std::string aside, SetAside(path, finding.is_older ? "older-" : "damaged-"));
  if (finding.is_older) return absl::OkStatus();
  const size_t jobs = records.JobIds().size();
  warnings.push_back(absl::StrCat("the list of jobs was damaged and is restored: ", jobs,
                                  jobs == 1 ? " job" : " jobs",
                                  " from their records; results are untouched. What was found is kept as ",
                                  aside, " (", finding.damage, ")"));
  return absl::OkStatus();
}

// Rows of the jobs whose records say more.
absl::Status PutRecords(const JobRecords& records, const Finding& finding,
                        std::vector<std::string>& warnings) {
  std::vector<std::pair<int64_t, std::string>> by_age;
  for (const std::string& id : records.JobIds()) {
    if (finding.settled.contains(id)) continue;
    const absl::StatusOr<v1::JobUpdate> record = records.Read(id);
    if (record.ok()) {
      by_age.emplace_back(record->job().created_unix_ns(), id);
    } else {
      warnings.push_back(
          absl::StrCat(absl::string_view(record.status().message()),
                       ", and the list of jobs lacks this job; its results are where it wrote "
                       "them, and a new job with the same inputs keeps them; remove the file"));
    }
  }
  std::ranges::sort(by_age);
  Database& database = *finding.database;
  Transaction transaction(database);
  WEFT_RETURN_IF_ERROR(transaction.Begin());
  WEFT_ASSIGN_OR_RETURN(const int64_t version, database.ReadNumber("PRAGMA user_version"));
  if (version != kSchemaVersion) WEFT_RETURN_IF_ERROR(MakeTables(database));
  for (const auto& [created, id] : by_age) {
    WEFT_ASSIGN_OR_RETURN(const v1::JobUpdate record, records.Read(id));
    WEFT_RETURN_IF_ERROR(PutRows(database, record));
  }
  return transaction.Commit();
}

}  // namespace

absl::StatusOr<RestoredCatalogue> OpenRestored(const std::string& path, const JobRecords& records) {
  RestoredCatalogue restored;
  WEFT_ASSIGN_OR_RETURN(Finding finding, Examine(path, records));
  if (finding.is_older || !finding.damage.empty())
    WEFT_RETURN_IF_ERROR(Replace(path, records, finding, restored.warnings));
  if (!finding.database) {
    WEFT_ASSIGN_OR_RETURN(finding.database, Database::Open(path));
  }
  WEFT_RETURN_IF_ERROR(PutRecords(records, finding, restored.warnings));
  // Records are newer now.
  if (finding.unkept.ok())
    std::ranges::for_each(kBackups, [&](const char* end) { RemoveDatabase(path + end); });
  restored.database = std::move(finding.database);
  return restored;
}

}  // namespace weft
