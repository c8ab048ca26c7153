#include "services/tools/cli/decode_inputs.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/image/image_file.h"
#include "capture/image/mosaic.h"
#include "capture/take/frame_range.h"
#include "capture/take/image_folder.h"
#include "capture/take/picture_choice.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

// The column `image`: the file name without folder and ending, or the paths where that is not unique.
absl::StatusOr<std::vector<std::string>> ImageNames(const std::vector<std::string>& paths) {
  std::set<std::string> different(paths.begin(), paths.end());
  if (different.size() != paths.size()) {
    std::vector<std::string> sorted = paths;
    std::ranges::sort(sorted);
    const auto twice = std::ranges::adjacent_find(sorted);
    return absl::InvalidArgumentError(absl::StrCat("the image ", *twice, " is given twice; give it once"));
  }
  std::vector<std::string> stems;
  for (const std::string& path : paths) stems.push_back(std::filesystem::path(path).stem().string());
  const std::set<std::string> different_stems(stems.begin(), stems.end());
  return different_stems.size() == paths.size() ? stems : paths;
}

// 0 where that is unknown.
// The column `image` of a view: its camera, with its frame where there are several.
std::string ViewName(const std::string& frame, const std::string& camera, const FrameRange& range) {
  return range.end - range.first == 1 ? camera : absl::StrCat(frame, "/", camera);
}

// The cameras of frames of a recorded take.
absl::StatusOr<DecodeInputs> ViewsOfTake(const std::string& folder, const std::string& frames) {
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<RecordedTake> opened, RecordedTake::Open(folder));
  const std::shared_ptr<const RecordedTake> take = std::move(opened);
  std::vector<std::string> names;
  for (const uint64_t set : take->sets()) names.push_back(FrameNameOf(set));
  WEFT_ASSIGN_OR_RETURN(const FrameRange range, FindFrameRange(frames, names, folder));
  DecodeInputs found;
  for (size_t index = range.first; index < range.end; ++index) {
    for (size_t camera = 0; camera < take->camera_ids().size(); ++camera) {
      const std::string& id = take->camera_ids()[camera];
      found.views.push_back({ViewName(names[index], id, range),
                             absl::StrCat(folder, ": frame ", names[index], ", camera ", id), [=] {
                               const absl::StatusOr<RawFrame> raw = take->ReadRaw(index, camera);
                               return raw.ok() ? ToFrame(*raw, DeepBits::kUsed)
                                               : absl::StatusOr<Frame>(raw.status());
                             }});
    }
  }
  return found;
}

// The cameras of frames of a dump.
absl::StatusOr<DecodeInputs> ViewsOfDump(const std::string& folder, const std::string& frames,
                                         std::optional<PixelFormat> mosaic) {
  if (IsRecordedTake(folder)) {
    if (!mosaic) return ViewsOfTake(folder, frames);
    return absl::InvalidArgumentError(absl::StrCat(
        folder, ": --mosaic is for image files; the cameras of a take say how their pixels lie"));
  }
  WEFT_ASSIGN_OR_RETURN(const ImageFolder images, ListImageFolder(folder));
  std::vector<std::string> names;
  for (const auto& [name, files] : images.frames) names.push_back(name);
  WEFT_ASSIGN_OR_RETURN(const FrameRange range, FindFrameRange(frames, names, folder));
  DecodeInputs found{{}, images.notes};
  for (size_t index = range.first; index < range.end; ++index) {
    for (const auto& [camera, path] : images.frames.at(names[index])) {
      found.views.push_back({ViewName(names[index], camera, range), path,
                             [path = path, mosaic] { return ReadImageFile(path, mosaic); }, FileBytes(path)});
    }
  }
  return found;
}

}  // namespace

absl::StatusOr<DecodeInputs> FindDecodeInputs(const std::vector<std::string>& images,
                                              const std::string& frames, const std::string& mosaic_name) {
  const auto mosaic = MosaicFromName(mosaic_name);
  if (!mosaic.ok()) return mosaic.status();
  if (images.size() == 1 && IsFolder(images[0])) return ViewsOfDump(images[0], frames, *mosaic);
  if (!frames.empty()) return absl::InvalidArgumentError("--frames is for one take or one folder of images");
  WEFT_ASSIGN_OR_RETURN(const auto names, ImageNames(images));
  DecodeInputs found;
  std::map<std::string, std::string> pictures;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string& path = images[i];
    found.views.push_back(
        {names[i], path, [path, mosaic = *mosaic] { return ReadImageFile(path, mosaic); }, FileBytes(path)});
    pictures[names[i]] = path;
  }
  found.notes = OrientationNotes(pictures);
  return found;
}

}  // namespace weft
