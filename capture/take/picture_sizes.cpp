#include "capture/take/picture_sizes.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_header.h"
#include "capture/rig/camera_match.h"

namespace weft {
namespace {

using Size = std::pair<int, int>;

struct SizedPicture {
  std::string frame, path;
};
using PicturesBySize = std::map<Size, std::vector<SizedPicture>>;

std::string SizeInPixels(const Size& size) { return absl::StrCat(size.first, "x", size.second); }

std::string FrameNames(const std::vector<SizedPicture>& pictures) {
  std::vector<std::string> names;
  for (const SizedPicture& picture : pictures) names.push_back(picture.frame);
  return FirstNames(names);
}

// Of pictures of two sizes or more.
absl::Status AddOdd(const std::string& camera, const PicturesBySize& sizes, OddPictures& odd) {
  size_t all = 0;
  for (const auto& [size, pictures] : sizes) all += pictures.size();
  const auto most = std::max_element(sizes.begin(), sizes.end(), [](const auto& a, const auto& b) {
    return a.second.size() < b.second.size();
  });
  std::vector<std::string> others;
  for (const auto& [size, pictures] : sizes) {
    if (size == most->first) continue;
    others.push_back(absl::StrCat(SizeInPixels(size), " (", FrameNames(pictures), ")"));
    for (const SizedPicture& picture : pictures)
      odd.why[picture.path] = absl::StrCat("is ", SizeInPixels(size), " pixels, most pictures of ", camera,
                                           " are ", SizeInPixels(most->first));
  }
  if (4 * most->second.size() < 3 * all) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", camera, ": its pictures have several sizes, ", SizeInPixels(most->first),
                     " (", FrameNames(most->second), ") and ", FirstNames(others),
                     "; a camera has one, so import each size as a take or a camera of its own"));
  }
  odd.notes.push_back(absl::StrCat("camera ", camera, ": its pictures are ", SizeInPixels(most->first),
                                   " pixels, and those of another size are missing: ", FirstNames(others)));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<OddPictures> FindOddPictures(const ImageFolder& folder) {
  std::map<std::string, PicturesBySize> by_camera;
  for (const auto& [frame, cameras] : folder.frames) {
    for (const auto& [camera, path] : cameras) {
      const absl::StatusOr<ImageHeader> header = ReadImageFileHeader(path);
      if (header.ok()) by_camera[camera][{header->width_px, header->height_px}].push_back({frame, path});
    }
  }
  OddPictures odd;
  for (const auto& [camera, sizes] : by_camera) {
    if (sizes.size() < 2) continue;
    WEFT_RETURN_IF_ERROR(AddOdd(camera, sizes, odd));
  }
  return odd;
}

}  // namespace weft
