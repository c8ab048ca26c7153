#include "capture/image_folder_dump.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/content_hash.h"
#include "capture/image_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

bool IsImage(const fs::path& path) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".tif" || ending == ".tiff";
}

// Numbers inside names compare by value: image9 before image10.
bool NaturalLess(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (absl::ascii_isdigit(a[i]) && absl::ascii_isdigit(b[j])) {
      size_t ie = i, je = j;
      while (ie < a.size() && absl::ascii_isdigit(a[ie])) ++ie;
      while (je < b.size() && absl::ascii_isdigit(b[je])) ++je;
      while (i + 1 < ie && a[i] == '0') ++i;
      while (j + 1 < je && b[j] == '0') ++j;
      if (ie - i != je - j) return ie - i < je - j;
      const int order = a.compare(i, ie - i, b, j, je - j);
      if (order != 0) return order < 0;
      i = ie;
      j = je;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

struct NaturalOrder {
  bool operator()(const std::string& a, const std::string& b) const { return NaturalLess(a, b); }
};

// [frame][camera id] -> path
using Listing = std::map<std::string, std::map<std::string, std::string>, NaturalOrder>;

std::vector<fs::directory_entry> Entries(const fs::path& folder, std::error_code& error) {
  std::vector<fs::directory_entry> out;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    out.push_back(*it);
  std::sort(out.begin(), out.end());
  return out;
}

// The camera of <dump>/cam<camera>/..., empty for other folders.
std::string CameraOfFolder(const fs::path& folder, const Rig& rig) {
  const std::string name = folder.filename().string();
  if (!absl::StartsWith(name, "cam")) return "";
  const std::string id = name.substr(3);
  return rig.IndexOf(id) >= 0 ? id : rig.IndexOf(name) >= 0 ? name : "";
}

Listing List(const std::string& folder, const Rig& rig, std::error_code& error) {
  Listing listing;
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
  return listing;
}

}  // namespace

absl::StatusOr<std::unique_ptr<ImageFolderDump>> ImageFolderDump::Open(const std::string& folder,
                                                                       const Rig& rig,
                                                                       const ImageFolderOptions& options) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return absl::NotFoundError(absl::StrCat(folder, ": no such folder"));
  const Listing listing = List(folder, rig, error);
  if (error)
    return absl::PermissionDeniedError(absl::StrCat(folder, ": cannot be listed (", error.message(), ")"));

  auto dump = std::unique_ptr<ImageFolderDump>(new ImageFolderDump);
  dump->rig_ = rig;
  dump->options_ = options;
  std::vector<int> images_of_camera(rig.cameras.size(), 0);
  std::map<std::string, int> unknown_cameras;
  for (const auto& [frame, files] : listing) {
    std::vector<std::string> paths(rig.cameras.size());
    int known = 0;
    for (const auto& [camera, path] : files) {
      const int index = rig.IndexOf(camera);
      if (index < 0) {
        ++unknown_cameras[camera];
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
        unknown_cameras.empty() ? ""
                                : absl::StrCat(" (found images of camera ", unknown_cameras.begin()->first,
                                               ", which the rig lacks)")));
  }
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    if (images_of_camera[i] == 0)
      dump->warnings_.push_back(
          absl::StrCat("camera ", rig.cameras[i].id, " of the rig has no images in ", folder));
  }
  for (const auto& [camera, count] : unknown_cameras) {
    dump->warnings_.push_back(
        absl::StrCat(count, " image(s) of camera ", camera, ", which the rig does not have, are left out"));
  }
  return dump;
}

absl::StatusOr<FrameSet> ImageFolderDump::Read(size_t index) const {
  if (index >= frame_names_.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frame_names_.size()));
  }
  FrameSet set;
  set.name = frame_names_[index];
  for (size_t i = 0; i < rig_.cameras.size(); ++i) {
    absl::StatusOr<Frame> frame = ReadView(index, i);
    if (frame.ok()) {
      set.frames.push_back(*std::move(frame));
    } else {
      set.missing.push_back({rig_.cameras[i].id, std::string(frame.status().message())});
    }
  }
  return set;
}

absl::StatusOr<Frame> ImageFolderDump::ReadView(size_t index, size_t camera) const {
  if (index >= frame_names_.size() || camera >= rig_.cameras.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frame_names_.size(), ", camera ",
                                              camera, " of ", rig_.cameras.size()));
  }
  const CameraModel& model = rig_.cameras[camera];
  const std::string& path = paths_[index][camera];
  if (path.empty()) return absl::NotFoundError("no image in the dump");
  absl::StatusOr<Frame> frame = ReadImageFile(path, options_.mosaic);
  if (!frame.ok()) return frame.status();
  if (frame->width_px != model.width_px || frame->height_px != model.height_px) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": image is ", frame->width_px, "x",
                                                   frame->height_px, ", the rig says ", model.width_px, "x",
                                                   model.height_px));
  }
  frame->camera_id = model.id;
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
