// Copies of the catalogue: <catalogue>.backup-1 is the newest, -2 is at least a day older than what was
// newest when it was kept, -3 again a day.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/server/catalogue/salvage.h"
#include "services/server/catalogue/sqlite.h"

namespace weft {

// One copy in the making.
class CatalogueBackup {
 public:
  // ResourceExhausted: it would leave less room on the disk than it takes itself. Errors of DatabaseCopy.
  static absl::StatusOr<std::unique_ptr<CatalogueBackup>> Start(Database& catalogue);
  ~CatalogueBackup();
  CatalogueBackup(const CatalogueBackup&) = delete;
  CatalogueBackup& operator=(const CatalogueBackup&) = delete;

  // Between two calls of the catalogue. True: all is copied.
  absl::StatusOr<bool> Step();
  // After the last step, at any time: reads the copy, and makes it the newest backup if it is sound.
  // DataLoss: it is not, so neither is the catalogue; the backups stay as they are.
  absl::Status Keep();

 private:
  explicit CatalogueBackup(std::string path) : path_(std::move(path)) {}

  const std::string path_;  // of the catalogue
  std::unique_ptr<DatabaseCopy> copy_;
};

std::string BackupPath(const std::string& catalogue, int number);
bool HasBackup(const std::string& catalogue);

// The newest sound backup: its path and content.
struct SoundBackup {
  std::string path;
  StoredCatalogue content;
};
std::optional<SoundBackup> ReadNewestBackup(const std::string& catalogue);

}  // namespace weft
