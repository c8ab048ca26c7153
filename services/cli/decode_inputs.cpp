#include "services/cli/decode_inputs.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "capture/image_file.h"
#include "capture/image_folder.h"
#include "capture/recorded_take.h"
#include "capture/take_files.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// The column `image`: the file name without folder and ending, or the paths where that is not unique.
absl::StatusOr<std::vector<std::string>> ImageNames(const std::vector<std::string>& paths) {
  std::set<std::string> different(paths.begin(), paths.end());
  if (different.size() != paths.size()) {
    std::vector<std::string> sorted = paths;
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    return absl::InvalidArgumentError(absl::StrCat("the image ", *twice, " is given twice; give it once"));
  }
  std::vector<std::string> stems;
  for (const std::string& path : paths) stems.push_back(fs::path(path).stem().string());
  const std::set<std::string> different_stems(stems.begin(), stems.end());
  return different_stems.size() == paths.size() ? stems : paths;
}

// The cameras of one frame of a recorded take.
absl::StatusOr<std::vector<DecodeInput>> ViewsOfTake(const std::string& folder, const std::string& frame) {
  absl::StatusOr<std::unique_ptr<RecordedTake>> opened = RecordedTake::Open(folder);
  if (!opened.ok()) return opened.status();
  const std::shared_ptr<const RecordedTake> take = *std::move(opened);
  uint64_t number = 0;
  const bool is_number = absl::SimpleAtoi(frame, &number);
  const auto at = std::lower_bound(take->sets().begin(), take->sets().end(), number);
  if (!is_number || at == take->sets().end() || *at != number) {
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": has no frame ", frame,
                     take->sets().empty()
                         ? ""
                         : absl::StrCat("; it holds ", take->sets().front(), " to ", take->sets().back())));
  }
  const auto index = static_cast<size_t>(at - take->sets().begin());
  std::vector<DecodeInput> views;
  for (size_t camera = 0; camera < take->camera_ids().size(); ++camera) {
    const std::string& id = take->camera_ids()[camera];
    views.push_back({id, absl::StrCat(folder, ": frame ", frame, ", camera ", id), [=] {
                       const absl::StatusOr<RawFrame> raw = take->ReadRaw(index, camera);
                       return raw.ok() ? ToFrame(*raw) : absl::StatusOr<Frame>(raw.status());
                     }});
  }
  return views;
}

// The cameras of one frame of a dump.
absl::StatusOr<std::vector<DecodeInput>> ViewsOfDump(const std::string& folder, const std::string& frame,
                                                     std::optional<PixelFormat> mosaic) {
  if (frame.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": a take or a folder of images; --frame says which of its frames"));
  }
  if (IsRecordedTake(folder)) return ViewsOfTake(folder, frame);
  const absl::StatusOr<ImageFolder> images = ListImageFolder(folder);
  if (!images.ok()) return images.status();
  for (const auto& [name, files] : *images) {
    if (name != frame) continue;
    std::vector<DecodeInput> views;
    for (const auto& [camera, path] : files)
      views.push_back({camera, path, [path = path, mosaic] { return ReadImageFile(path, mosaic); }});
    return views;
  }
  return absl::InvalidArgumentError(absl::StrCat(folder, ": has no frame ", frame));
}

absl::StatusOr<std::optional<PixelFormat>> MosaicByName(const std::string& name) {
  if (name.empty()) return std::nullopt;
  const absl::StatusOr<PixelFormat> format = PixelFormatFromName(name);
  if (!format.ok() || *format == PixelFormat::kGrey8 || *format == PixelFormat::kRgb8) {
    return absl::InvalidArgumentError(
        absl::StrCat("--mosaic ", name,
                     " is no order of a Bayer mosaic; it is bayer_rg8, bayer_gr8, bayer_gb8 or bayer_bg8"));
  }
  return *format;
}

}  // namespace

absl::StatusOr<std::vector<DecodeInput>> FindDecodeInputs(const std::vector<std::string>& images,
                                                          const std::string& frame,
                                                          const std::string& mosaic_name) {
  const auto mosaic = MosaicByName(mosaic_name);
  if (!mosaic.ok()) return mosaic.status();
  std::error_code error;
  if (images.size() == 1 && fs::is_directory(images[0], error)) return ViewsOfDump(images[0], frame, *mosaic);
  if (!frame.empty()) return absl::InvalidArgumentError("--frame is for one take or one folder of images");
  const auto names = ImageNames(images);
  if (!names.ok()) return names.status();
  std::vector<DecodeInput> inputs;
  for (size_t i = 0; i < names->size(); ++i) {
    const std::string& path = images[i];
    inputs.push_back({(*names)[i], path, [path, mosaic = *mosaic] { return ReadImageFile(path, mosaic); }});
  }
  return inputs;
}

}  // namespace weft
