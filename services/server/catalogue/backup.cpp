#include "services/server/catalogue/backup.h"

#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/server/catalogue/catalogue_rows.h"
#include "services/server/catalogue/folder_sync.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kBackups = 3;
constexpr int kPagesPerStep = 256;  // 1 MiB: a few milliseconds
constexpr std::chrono::hours kKeptFor{24};

std::string CopyPath(const std::string& catalogue) { return catalogue + ".backup.tmp"; }

// DataLoss: not whole.
absl::StatusOr<StoredCatalogue> ReadSound(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Database> database, Database::OpenToRead(path));
  WEFT_RETURN_IF_ERROR(database->CheckIntegrity());
  WEFT_ASSIGN_OR_RETURN(const int64_t version, database->ReadPragma("user_version"));
  StoredCatalogue content = ReadStored(*database, version);
  if (!content.damage.empty()) return absl::DataLossError(absl::StrCat(path, ": ", content.damage));
  return content;
}

bool IsOld(const std::string& path) {
  std::error_code error;
  const fs::file_time_type written = fs::last_write_time(path, error);
  return error || fs::file_time_type::clock::now() - written >= kKeptFor;
}

}  // namespace

std::string BackupPath(const std::string& catalogue, int number) {
  return absl::StrCat(catalogue, ".backup-", number);
}

bool HasBackup(const std::string& catalogue) {
  for (int number = 1; number <= kBackups; ++number) {
    if (FileBytes(BackupPath(catalogue, number)) > 0) return true;
  }
  return false;
}

absl::StatusOr<std::unique_ptr<CatalogueBackup>> CatalogueBackup::Start(Database& catalogue) {
  const std::string& path = catalogue.path();
  const uintmax_t size = FileBytes(path) + FileBytes(path + "-wal");
  std::error_code error;
  const fs::space_info space = fs::space(fs::path(path).parent_path(), error);
  if (!error && space.available < 2 * size) {
    return absl::ResourceExhaustedError(absl::StrCat(path, ": no room for its backup, which takes up to ",
                                                     size, " bytes; make room on the disk"));
  }
  std::unique_ptr<CatalogueBackup> backup(new CatalogueBackup(path));
  RemoveDatabase(CopyPath(path));
  WEFT_ASSIGN_OR_RETURN(backup->copy_, DatabaseCopy::Start(catalogue, CopyPath(path)));
  return backup;
}

CatalogueBackup::~CatalogueBackup() {
  copy_.reset();
  RemoveDatabase(CopyPath(path_));
}

absl::StatusOr<bool> CatalogueBackup::Step() { return copy_->Step(kPagesPerStep); }

absl::Status CatalogueBackup::Keep() {
  copy_.reset();
  WEFT_RETURN_IF_ERROR(ReadSound(CopyPath(path_)).status());
  std::error_code error;
  for (int number = kBackups; number > 1; --number) {
    const std::string newer = BackupPath(path_, number - 1), older = BackupPath(path_, number);
    if (fs::exists(newer, error) && IsOld(older)) fs::rename(newer, older, error);
  }
  fs::rename(CopyPath(path_), BackupPath(path_, 1), error);
  if (!error) return SyncFolderOf(path_);
  return absl::UnavailableError(
      absl::StrCat(BackupPath(path_, 1), ": cannot be written (", error.message(), ")"));
}

std::optional<SoundBackup> ReadNewestBackup(const std::string& catalogue) {
  for (int number = 1; number <= kBackups; ++number) {
    const std::string path = BackupPath(catalogue, number);
    if (FileBytes(path) == 0) continue;
    absl::StatusOr<StoredCatalogue> content = ReadSound(path);
    if (content.ok()) return SoundBackup{path, *std::move(content)};
  }
  return std::nullopt;
}

}  // namespace weft
