#include "capture/take/image_folder.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"

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

std::string NameOf(const fs::path& path) { return path.filename().string(); }

std::string ComplainOfNames(const std::vector<std::string>& paths) {
  return absl::StrCat(EscapedText(paths.front()),
                      paths.size() == 1 ? "" : absl::StrCat(" and ", paths.size() - 1, " more"),
                      ": the name is not UTF-8 text without control characters; rename it");
}

}  // namespace

absl::StatusOr<ImageFolder> ListImageFolder(const std::string& folder, const Rig* rig,
                                            std::vector<std::string>* warnings) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return absl::NotFoundError(absl::StrCat(EscapedText(folder), ": no such folder"));
  ImageFolder listing;
  std::vector<std::string> unfit;
  for (const fs::directory_entry& entry : Entries(folder, error)) {
    std::error_code entry_error;
    if (!entry.is_directory(entry_error)) continue;
    const bool fit = IsPlainText(NameOf(entry.path()));
    const std::string camera_of_folder = CameraOfFolder(entry.path(), rig);
    for (const fs::directory_entry& file : Entries(entry.path(), entry_error)) {
      if (!IsImage(file.path())) continue;
      const std::string stem = file.path().stem().string();
      if (!fit || !IsPlainText(stem)) {
        unfit.push_back(fit ? file.path().string() : entry.path().string());
        if (!fit) break;
      } else if (camera_of_folder.empty()) {
        listing[NameOf(entry.path())][stem] = file.path().string();
      } else if (absl::StartsWith(stem, "image")) {
        listing[stem.substr(5)][camera_of_folder] = file.path().string();
      }
    }
  }
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat(EscapedText(folder), ": cannot be listed (", error.message(), ")"));
  }
  if (unfit.empty()) return listing;
  if (warnings == nullptr) return absl::InvalidArgumentError(ComplainOfNames(unfit));
  warnings->push_back(absl::StrCat(ComplainOfNames(unfit), "; left out until then"));
  return listing;
}

}  // namespace weft
