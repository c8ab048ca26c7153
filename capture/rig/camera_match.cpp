#include "capture/rig/camera_match.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace weft {

std::string FirstNames(const std::vector<std::string>& names) {
  constexpr size_t kShown = 8;
  const size_t shown = std::min(names.size(), kShown);
  const std::string first =
      absl::StrJoin(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), ", ");
  return names.size() == shown ? first : absl::StrCat(first, " and ", names.size() - shown, " more");
}

std::vector<std::string> CameraWarnings(const CameraMatch& match, const std::string& recording) {
  std::vector<std::string> lines;
  const size_t missing = match.without_images.size(), unknown = match.without_model.size();
  if (missing == 1) {
    lines.push_back(
        absl::StrCat("camera ", match.without_images[0], " of the rig has no images in ", recording));
  } else if (missing > 1) {
    lines.push_back(absl::StrCat(missing, " of ", match.of_rig, " cameras of the rig have no images in ",
                                 recording, ": ", FirstNames(match.without_images)));
  }
  if (unknown > 0) {
    lines.push_back(absl::StrCat(
        unknown, " of ", match.of_recording, " cameras of ", recording, unknown == 1 ? " is" : " are",
        " not in the rig: ", FirstNames(match.without_model), "; is it the rig of this take?"));
  }
  return lines;
}

}  // namespace weft
