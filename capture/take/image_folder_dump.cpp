#include "capture/take/image_folder_dump.h"

#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"
#include "capture/image/image_file.h"
#include "capture/rig/camera_match.h"
#include "capture/take/frame_number.h"
#include "capture/take/frame_set_reading.h"
#include "capture/take/image_folder.h"

namespace weft {
namespace fs = std::filesystem;
namespace {

// Frames beside a gap in their numbers are registered without those across it.
void NoteGaps(const std::vector<std::string>& names, std::vector<std::string>& warnings) {
  const FrameSteps steps(names);
  std::vector<std::string> gaps;
  for (size_t i = 1; i < names.size(); ++i) {
    if (steps.Between(i - 1, i) > 1) gaps.push_back(absl::StrCat(names[i - 1], " to ", names[i]));
  }
  if (gaps.empty()) return;
  warnings.push_back(absl::StrCat("numbers of frames have ", gaps.size(),
                                  gaps.size() == 1 ? " gap, " : " gaps, ", FirstNames(gaps),
                                  "; frames on either side are no neighbours"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<ImageFolderDump>> ImageFolderDump::Open(const std::string& folder,
                                                                       const Rig& rig,
                                                                       const ImageFolderOptions& options) {
  auto dump = std::unique_ptr<ImageFolderDump>(new ImageFolderDump);
  WEFT_ASSIGN_OR_RETURN(ImageFolder listing, ListImageFolder(folder, &rig, UnfitNames::kLeaveOut));
  dump->warnings_ = std::move(listing.notes);

  dump->rig_ = rig;
  dump->options_ = options;
  std::vector<int> images_of_camera(rig.cameras.size(), 0);
  std::set<std::string, NaturalOrder> unknown_cameras;
  for (const auto& [frame, files] : listing.frames) {
    std::vector<std::string> paths(rig.cameras.size());
    int known = 0;
    for (const auto& [camera, path] : files) {
      const int index = rig.IndexOf(camera);
      if (index < 0) {
        unknown_cameras.insert(camera);
        continue;
      }
      paths[index] = path;
      ++images_of_camera[index];
      ++known;
    }
    if (known == 0) continue;
    dump->frame_names_.push_back(frame);
    dump->paths_.push_back(std::move(paths));
  }
  if (dump->frame_names_.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        folder,
        ": holds no image of any camera of the rig; expected <frame>/<camera>.png or "
        "cam<camera>/image<frame>.png",
        unknown_cameras.empty()
            ? ""
            : absl::StrCat(" (found images of ", FirstNames({unknown_cameras.begin(), unknown_cameras.end()}),
                           ", which the rig lacks; is it the rig of this take?)"),
        dump->warnings_.empty() ? "" : absl::StrCat("; ", dump->warnings_.front())));
  }
  NoteGaps(dump->frame_names_, dump->warnings_);
  CameraMatch match{.of_rig = rig.cameras.size(),
                    .of_recording = unknown_cameras.size(),
                    .without_images = {},
                    .without_model = {unknown_cameras.begin(), unknown_cameras.end()}};
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    match.of_recording += images_of_camera[i] > 0;
    if (images_of_camera[i] == 0) match.without_images.push_back(rig.cameras[i].id);
  }
  for (std::string& warning : CameraWarnings(match, folder)) dump->warnings_.push_back(std::move(warning));
  dump->unknown_cameras_ = std::move(match.without_model);
  return dump;
}

absl::StatusOr<FrameSet> ImageFolderDump::Read(size_t index) const {
  return ReadFrameSet(*this, rig_, index);
}

absl::StatusOr<std::string> ImageFolderDump::PathOf(size_t index, size_t camera) const {
  if (index >= frame_names_.size() || camera >= rig_.cameras.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frame_names_.size(), ", camera ",
                                              camera, " of ", rig_.cameras.size()));
  }
  if (paths_[index][camera].empty()) return absl::NotFoundError("no image in the dump");
  return paths_[index][camera];
}

absl::StatusOr<Frame> ImageFolderDump::ReadView(size_t index, size_t camera) const {
  const absl::StatusOr<std::string> path = PathOf(index, camera);
  return path.ok() ? ReadCopy(*path, index, camera) : path.status();
}

absl::StatusOr<StoredView> ImageFolderDump::Locate(size_t index, size_t camera) const {
  WEFT_ASSIGN_OR_RETURN(const std::string path, PathOf(index, camera));
  std::error_code error;
  const uint64_t bytes = fs::file_size(path, error);
  if (error) return absl::NotFoundError(absl::StrCat(path, ": ", error.message()));
  return StoredView{path, 0, bytes};
}

absl::StatusOr<Frame> ImageFolderDump::ReadCopy(const std::string& copy, size_t index, size_t camera) const {
  WEFT_ASSIGN_OR_RETURN(const std::string path, PathOf(index, camera));
  const CameraModel& model = rig_.cameras[camera];
  WEFT_ASSIGN_OR_RETURN(Frame frame,
                        ReadImageFile(copy, options_.mosaic, ImageSize{model.width_px, model.height_px}));
  frame.camera_id = model.id;
  frame.origin = path;
  return frame;
}

absl::StatusOr<std::string> ImageFolderDump::Fingerprint(size_t index) const {
  if (index >= frame_names_.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frame_names_.size()));
  }
  ContentHash hash;
  hash.Add(frame_names_[index]);
  for (size_t i = 0; i < rig_.cameras.size(); ++i) {
    const fs::path path = paths_[index][i];
    std::error_code error;
    const auto size = path.empty() ? 0 : fs::file_size(path, error);
    const auto time = path.empty() ? fs::file_time_type{} : fs::last_write_time(path, error);
    hash.Add(rig_.cameras[i].id).Add(path.filename().string());
    hash.AddInteger(error ? 0 : size);
    hash.AddInteger(error ? 0 : static_cast<uint64_t>(time.time_since_epoch().count()));
  }
  return hash.Hex();
}

}  // namespace weft
