#include "capture/take/take_files.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/natural_order.h"

namespace weft {

namespace fs = std::filesystem;

std::string StreamFolder(const std::string& take) { return (fs::path(take) / "streams").string(); }
std::string StreamFile(const std::string& stream_folder, const std::string& camera_id) {
  return (fs::path(stream_folder) / (camera_id + ".stream")).string();
}
std::string IndexFile(const std::string& stream_folder, const std::string& camera_id) {
  return (fs::path(stream_folder) / (camera_id + ".index")).string();
}
std::string LedgerFile(const std::string& take) { return (fs::path(take) / "ledger.csv").string(); }

bool IsRecordedTake(const std::string& folder) {
  std::error_code error;
  return fs::is_directory(StreamFolder(folder), error);
}

absl::StatusOr<std::vector<std::string>> CamerasOfTake(const std::string& take) {
  std::error_code error;
  if (!fs::is_directory(take, error)) return absl::NotFoundError(absl::StrCat(take, ": no such folder"));
  std::vector<std::string> ids;
  fs::directory_iterator it(StreamFolder(take), error);
  if (error) return absl::NotFoundError(absl::StrCat(take, ": no recorded take, it has no folder streams"));
  for (const fs::directory_iterator end; !error && it != end; it.increment(error)) {
    if (it->path().extension() == ".stream") ids.push_back(it->path().stem().string());
  }
  if (error)
    return absl::UnavailableError(absl::StrCat(take, "/streams: cannot be listed (", error.message(), ")"));
  if (ids.empty()) return absl::NotFoundError(absl::StrCat(take, "/streams: holds no stream"));
  std::sort(ids.begin(), ids.end(), NaturalLess);
  return ids;
}

}  // namespace weft
