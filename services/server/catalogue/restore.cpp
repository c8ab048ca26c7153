#include "services/server/catalogue/restore.h"

#include <filesystem>
#include <optional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/server/catalogue/backup.h"
#include "services/server/catalogue/catalogue_rows.h"
#include "services/server/catalogue/folder_sync.h"
#include "services/server/catalogue/salvage.h"
#include "services/server/catalogue/sqlite.h"
#include "services/server/catalogue/wal_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMaxCredibleVersion = 1000;  // of a newer Weft; beyond it the number itself is damaged

// What is to be done with a file.
struct Finding {
  bool replace = false;
  bool older = false;  // sound, of an older Weft
  std::string reason;
};

bool IsEmpty(const std::string& path) { return FileBytes(path) == 0; }

Finding DamagedFile(absl::string_view reason) { return {true, false, std::string(reason)}; }

// The rows, once the file itself is in order.
absl::StatusOr<Finding> ExamineRows(Database& database, int64_t version) {
  const StoredCatalogue stored = ReadStored(database, version);
  if (!stored.damage.empty()) return DamagedFile(stored.damage);
  const std::optional<SoundBackup> backup = ReadNewestBackup(database.path());
  if (backup && IsBehind(stored, backup->content)) {
    return DamagedFile(absl::StrCat(database.path(), ": lacks what its backup ", backup->path, " holds"));
  }
  if (version == kSchemaVersion) return Finding{};
  return Finding{true, true, absl::StrCat(database.path(), ": of an older Weft")};
}

absl::StatusOr<Finding> ExamineContent(Database& database) {
  WEFT_ASSIGN_OR_RETURN(const int64_t version, database.ReadPragma("user_version"));
  if (version > kSchemaVersion && version < kMaxCredibleVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat(database.path(), ": written by a newer Weft (schema ", version, ", this one knows ",
                     kSchemaVersion, "); install that version, or give another --state folder"));
  }
  WEFT_RETURN_IF_ERROR(database.CheckIntegrity());
  WEFT_ASSIGN_OR_RETURN(const int64_t objects, database.ReadNumber("SELECT count(*) FROM sqlite_schema"));
  // SQLite's own crash while it made the file.
  if (version == 0 && objects == 0 && !HasBackup(database.path())) return Finding{};
  if (version < kFirstSchemaVersion || version > kSchemaVersion || objects == 0) {
    return DamagedFile(absl::StrCat(database.path(), ": damaged (the tables are gone, or their version is)"));
  }
  return ExamineRows(database, version);
}

absl::StatusOr<Finding> Examine(const std::string& path) {
  const bool has_log = !IsEmpty(path + "-wal");
  if (!PathExists(path)) {
    if (!has_log && !HasBackup(path)) return Finding{};  // a new state folder
    return DamagedFile(absl::StrCat(path, ": is gone"));
  }
  if (IsEmpty(path)) return DamagedFile(absl::StrCat(path, ": is empty"));
  const absl::StatusOr<WalFile> wal = ReadWalFile(path + "-wal");
  if (!wal.ok() || wal->damaged) return DamagedFile(absl::StrCat(path, "-wal: damaged"));
  const absl::StatusOr<std::unique_ptr<Database>> database = Database::Open(path);
  absl::StatusOr<Finding> finding =
      database.ok() ? ExamineContent(**database) : absl::StatusOr<Finding>(database.status());
  if (absl::IsDataLoss(finding.status()) || absl::IsInternal(finding.status())) {
    return DamagedFile(finding.status().message());
  }
  return finding;
}

absl::Status WriteNew(const std::string& path, const std::vector<RestoredJob>& jobs) {
  RemoveDatabase(path);
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Database> database, Database::Open(path));
  Transaction transaction(*database);
  WEFT_RETURN_IF_ERROR(transaction.Begin());
  WEFT_RETURN_IF_ERROR(MakeTables(*database));
  WEFT_ASSIGN_OR_RETURN(Statement replace, database->Prepare(kReplaceFrame));
  for (const RestoredJob& restored : jobs) {
    WEFT_RETURN_IF_ERROR(InsertRow(*database, MakeRow(restored.job)));
    for (const auto& [position, info] : restored.frames) {
      WEFT_RETURN_IF_ERROR(ReplaceRow(replace, MakeRow(restored.job.id(), position, info)));
    }
  }
  WEFT_RETURN_IF_ERROR(transaction.Commit());
  // One file, so that one rename puts it in place.
  return database->Execute("PRAGMA journal_mode = DELETE");
}

// Files that wait to take the catalogue's place are called <path>.new.<name>; what they replace becomes
// <path>.<name>.
constexpr char kWaiting[] = ".new.";

// Never over another file.
std::string FreeName(const std::string& name) {
  std::string free = name;
  for (int i = 2; PathExists(free); ++i) free = absl::StrCat(name, ".", i);
  return free;
}

absl::Status Rename(const std::string& from, const std::string& to) {
  std::error_code error;
  if (!fs::exists(from, error)) return absl::OkStatus();
  fs::rename(from, to, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat(from, ": cannot be renamed to ", to, " (", error.message(), ")"));
}

// Every step may be the last one before a crash: the next call goes on.
absl::Status PutInPlace(const std::string& path, const std::string& name) {
  const std::string aside = absl::StrCat(path, ".", name);
  for (const char* ending : {"", "-wal", "-journal"}) {
    WEFT_RETURN_IF_ERROR(Rename(path + ending, FreeName(aside + ending)));
  }
  WEFT_RETURN_IF_ERROR(SyncFolderOf(path));
  WEFT_RETURN_IF_ERROR(Rename(absl::StrCat(path, kWaiting, name), path));
  return SyncFolderOf(path);
}

// What a crash left waiting.
absl::Status FinishReplacing(const std::string& path) {
  const std::string prefix = fs::path(path).filename().string() + kWaiting;
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fs::path(path).parent_path(), error)) {
    const std::string file = entry.path().filename().string();
    if (absl::StartsWith(file, prefix)) names.push_back(file.substr(prefix.size()));
  }
  for (const std::string& name : names) {
    WEFT_RETURN_IF_ERROR(PutInPlace(path, name));
  }
  return absl::OkStatus();
}

std::string Jobs(size_t count) { return absl::StrCat(count, count == 1 ? " job" : " jobs"); }

absl::StatusOr<std::vector<std::string>> Replace(const std::string& path, const Finding& finding) {
  const std::string time = UtcFileName();
  const std::string name = absl::StrCat(finding.older ? "older-" : "damaged-", time);
  const std::string aside = absl::StrCat(path, ".", name);
  WEFT_ASSIGN_OR_RETURN(StoredCatalogue stored, SalvageFile(path, path + ".reading"));
  const std::optional<SoundBackup> backup = ReadNewestBackup(path);
  const int added = backup ? Complete(stored, backup->content) : 0;
  const std::vector<RestoredJob> jobs =
      RestoreJobs(stored, absl::StrCat("the damaged catalogue is kept as ", aside));

  const std::string building = path + ".building";
  if (absl::Status status = WriteNew(building, jobs); !status.ok()) {
    RemoveDatabase(building);
    return status;
  }
  WEFT_RETURN_IF_ERROR(Rename(building, absl::StrCat(path, kWaiting, name)));
  WEFT_RETURN_IF_ERROR(SyncFolderOf(path));
  WEFT_RETURN_IF_ERROR(PutInPlace(path, name));
  if (finding.older) return std::vector<std::string>();
  return std::vector<std::string>{
      absl::StrCat("the list of jobs was damaged and is restored: ", Jobs(jobs.size()),
                   added == 0 ? "" : absl::StrCat(", ", added, " of them from the backup ", backup->path),
                   "; results are untouched. What was found is kept as ", aside, " (", finding.reason, ")")};
}

}  // namespace

absl::StatusOr<std::vector<std::string>> MakeCatalogueSound(const std::string& path) {
  WEFT_RETURN_IF_ERROR(FinishReplacing(path));
  WEFT_ASSIGN_OR_RETURN(const Finding finding, Examine(path));
  if (!finding.replace) return std::vector<std::string>();
  return Replace(path, finding);
}

}  // namespace weft
