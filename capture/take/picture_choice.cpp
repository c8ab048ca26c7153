#include "capture/take/picture_choice.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "capture/image/image_header.h"
#include "capture/rig/camera_match.h"

namespace weft {
namespace {

// A file whose header cannot be read has no size, and is chosen by none.
ImageSize SizeByHeader(const std::string& path) {
  const absl::StatusOr<ImageHeader> header = ReadImageFileHeader(path);
  return header.ok() ? ImageSize{header->width_px, header->height_px} : ImageSize{};
}

// Previews are: half as large at most.
bool IsPreviewOf(const ImageSize& preview, const ImageSize& picture) {
  return 2 * preview.width_px <= picture.width_px && 2 * preview.height_px <= picture.height_px;
}

std::string SizeWords(const std::string& path, const ImageSize& size) {
  return absl::StrCat(EscapedText(std::filesystem::path(path).filename().string()), " of ", size.width_px,
                      "x", size.height_px);
}

}  // namespace

absl::StatusOr<std::string> ChoosePicture(const std::vector<std::string>& paths,
                                          const std::optional<ImageSize>& expected) {
  std::vector<std::pair<std::string, ImageSize>> files;
  for (const std::string& path : paths) files.emplace_back(path, SizeByHeader(path));
  const auto fits = [&expected](const auto& file) {
    return file.second.width_px == expected->width_px && file.second.height_px == expected->height_px;
  };
  if (expected && std::count_if(files.begin(), files.end(), fits) == 1)
    return std::find_if(files.begin(), files.end(), fits)->first;
  for (const auto& [path, size] : files) {
    const bool is_largest = std::all_of(files.begin(), files.end(), [&](const auto& other) {
      return other.first == path || IsPreviewOf(other.second, size);
    });
    if (is_largest && size.width_px > 0) return path;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(EscapedText(std::filesystem::path(paths[0]).parent_path().string()),
                   ": two pictures of one camera, ", SizeWords(files[0].first, files[0].second), " and ",
                   SizeWords(files[1].first, files[1].second), " pixels; keep one of them in the folder"));
}

std::vector<std::string> OrientationNotes(const std::map<std::string, std::string>& pictures) {
  std::map<int, std::vector<std::string>> marked;
  for (const auto& [name, path] : pictures) {
    const absl::StatusOr<ImageHeader> header = ReadImageFileHeader(path);
    if (header.ok() && header->orientation > 1) marked[header->orientation].push_back(name);
  }
  std::vector<std::string> notes;
  for (const auto& [orientation, names] : marked) {
    notes.push_back(absl::StrCat("pictures of ", FirstNames(names), " say that they are to be shown ",
                                 OrientationText(orientation),
                                 "; pixels are taken as they are stored, as the rig must have them"));
  }
  return notes;
}

}  // namespace weft
