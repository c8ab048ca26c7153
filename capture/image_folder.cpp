#include "capture/image_folder.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

bool IsImage(const fs::path& path) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".tif" || ending == ".tiff";
}

std::vector<fs::directory_entry> Entries(const fs::path& folder, std::error_code& error) {
  std::vector<fs::directory_entry> out;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    out.push_back(*it);
  std::sort(out.begin(), out.end());
  return out;
}

// The camera of <dump>/cam<camera>/..., empty for other folders.
std::string CameraOfFolder(const fs::path& folder, const Rig* rig) {
  const std::string name = folder.filename().string();
  if (!absl::StartsWith(name, "cam")) return "";
  const std::string id = name.substr(3);
  if (rig == nullptr || rig->IndexOf(id) >= 0) return id;
  return rig->IndexOf(name) >= 0 ? name : "";
}

}  // namespace

absl::StatusOr<ImageFolder> ListImageFolder(const std::string& folder, const Rig* rig) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return absl::NotFoundError(absl::StrCat(folder, ": no such folder"));
  ImageFolder listing;
  for (const fs::directory_entry& entry : Entries(folder, error)) {
    std::error_code entry_error;
    if (!entry.is_directory(entry_error)) continue;
    const std::string camera_of_folder = CameraOfFolder(entry.path(), rig);
    for (const fs::directory_entry& file : Entries(entry.path(), entry_error)) {
      if (!IsImage(file.path())) continue;
      const std::string stem = file.path().stem().string();
      if (camera_of_folder.empty()) {
        listing[entry.path().filename().string()][stem] = file.path().string();
      } else if (absl::StartsWith(stem, "image")) {
        listing[stem.substr(5)][camera_of_folder] = file.path().string();
      }
    }
  }
  if (!error) return listing;
  return absl::PermissionDeniedError(absl::StrCat(folder, ": cannot be listed (", error.message(), ")"));
}

}  // namespace weft
