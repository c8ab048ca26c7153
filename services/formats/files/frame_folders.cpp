#include "services/formats/files/frame_folders.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "base/path_facts.h"

namespace weft {

namespace fs = std::filesystem;

absl::StatusOr<std::vector<std::string>> ListFrameFolders(const std::string& result, FrameFile file) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(result, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (PathExists(entry->path() / "template.json")) continue;  // stands beside the frames of a take
    if (IsRegularFile(entry->path() / FileName(file))) names.push_back(entry->path().filename().string());
  }
  if (error == std::errc::no_such_file_or_directory) {
    return absl::NotFoundError(absl::StrCat(result, ": no such folder"));
  }
  if (error) {
    return absl::PermissionDeniedError(absl::StrCat(result, ": cannot be listed (", error.message(), ")"));
  }
  std::ranges::sort(names, NaturalLess);
  return names;
}

}  // namespace weft
