#include "services/studio/calibration/detect_boards.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/status_macros.h"
#include "capture/calibration/moving_edges.h"
#include "capture/image/image_header.h"
#include "capture/take/image_folder.h"
#include "capture/take/recorded_take.h"

namespace weft {
namespace {

CameraModel OfSize(const std::string& id, int width_px, int height_px) {
  CameraModel camera;
  camera.id = id;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = std::max(width_px, height_px);
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  return camera;
}

absl::StatusOr<Rig> CamerasOfTake(const RecordedTake& take) {
  Rig rig;
  for (size_t c = 0; c < take.camera_ids().size(); ++c) {
    for (size_t set = 0; set < take.sets().size(); ++set) {
      const absl::StatusOr<RawFrame> frame = take.ReadRaw(set, c);
      if (!frame.ok()) continue;
      rig.cameras.push_back(OfSize(take.camera_ids()[c], frame->width_px, frame->height_px));
      break;
    }
  }
  return rig;
}

absl::StatusOr<Rig> CamerasOfFolder(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const ImageFolder images, ListImageFolder(folder));
  std::map<std::string, absl::StatusOr<ImageHeader>, NaturalOrder> first;  // that can be read, where one can
  for (const auto& [frame, cameras] : images.frames) {
    for (const auto& [camera, path] : cameras) {
      const auto known = first.find(camera);
      if (known == first.end() || !known->second.ok())
        first.insert_or_assign(camera, ReadImageFileHeader(path));
    }
  }
  Rig rig;
  for (const auto& [camera, header] : first) {
    if (!header.ok()) return header.status();
    rig.cameras.push_back(OfSize(camera, header->width_px, header->height_px));
  }
  return rig;
}

using Detectors = tbb::enumerable_thread_specific<std::unique_ptr<TagDetector>>;

// Some images of the camera, spread over the recording.
std::vector<Frame> Looks(const FrameSource& source, const std::vector<size_t>& frames, size_t camera) {
  constexpr size_t kLooks = 12;
  std::vector<Frame> out;
  for (size_t i = 0; i < std::min(kLooks, frames.size()); ++i) {
    const size_t frame = frames[i * frames.size() / std::min(kLooks, frames.size())];
    if (absl::StatusOr<Frame> image = source.ReadView(frame, camera); image.ok())
      out.push_back(*std::move(image));
  }
  return out;
}

// Whether the camera's images show tags when left and right are exchanged.
bool SeesMirrored(const std::vector<Frame>& looks, const TagDetector& detector) {
  for (const Frame& image : looks) {
    const absl::StatusOr<Frame> mirrored = MirroredGrey(image);
    if (!mirrored.ok()) continue;
    const absl::StatusOr<ImageTags> tags = detector.Detect(*mirrored);
    if (tags.ok() && tags->tags.size() >= 2) return true;
  }
  return false;
}

}  // namespace

absl::StatusOr<Rig> CamerasOfDump(const std::string& folder) {
  const absl::StatusOr<std::unique_ptr<RecordedTake>> take = RecordedTake::Open(folder);
  absl::StatusOr<Rig> rig = take.ok() ? CamerasOfTake(**take) : CamerasOfFolder(folder);
  if (rig.ok() && rig->cameras.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(folder, ": holds no images of any camera"));
  }
  return rig;
}

absl::StatusOr<BoardDetection> DetectBoards(const FrameSource& source, const Rig& cameras,
                                            const CalibrationTarget& target,
                                            const TagDetectionOptions& options,
                                            const std::vector<size_t>& frames,
                                            const std::function<void(size_t, size_t)>& on_image) {
  std::set<std::string> families;
  for (const TagBoard& board : target.boards) families.insert(board.family);
  for (const ScaleBar& bar : target.scale_bars) families.insert(bar.family);
  const std::vector<std::string> names(families.begin(), families.end());
  WEFT_RETURN_IF_ERROR(TagDetector::Make(names, options).status());
  Detectors detectors([&] { return *TagDetector::Make(names, options); });

  const size_t count = cameras.cameras.size();
  std::vector<absl::StatusOr<ImageTags>> found(frames.size() * count);
  std::atomic<size_t> done = 0;
  tbb::parallel_for(size_t{0}, found.size(), [&](size_t i) {
    const absl::StatusOr<Frame> image = source.ReadView(frames[i / count], i % count);
    found[i] = image.ok() ? detectors.local()->Detect(*image) : image.status();
    if (on_image) on_image(++done, found.size());
  });

  BoardDetection out;
  out.warnings = source.warnings();
  out.sightings.resize(count);
  for (const CameraModel& camera : cameras.cameras)
    out.views.cameras.push_back({camera.id, camera.width_px, camera.height_px});
  for (const size_t f : frames) out.views.frames.push_back(source.frame_names()[f]);
  for (size_t i = 0; i < found.size(); ++i) {
    const size_t camera = i % count, frame = i / count;
    if (!found[i].ok()) {
      const std::string who =
          absl::StrCat("camera ", cameras.cameras[camera].id, ", frame ", out.views.frames[frame], ": ");
      out.warnings.push_back(absl::StrCat(who, absl::StripPrefix(found[i].status().message(), who)));
      continue;
    }
    CameraSightings& s = out.sightings[camera];
    ++s.images;
    s.tags += static_cast<int>(found[i]->tags.size());
    // A mean over the images, weighted by their blurred tags.
    if (found[i]->blurred > 0) {
      s.blurred_px +=
          (found[i]->blurred_px - s.blurred_px) * found[i]->blurred / (s.blurred_tags + found[i]->blurred);
    }
    s.blurred_tags += found[i]->blurred;
    s.small_tags += found[i]->small;
    s.unclear_tags += found[i]->unclear;
    AddSightings(target, static_cast<int>(camera), static_cast<int>(frame), found[i]->tags, &out.views);
  }
  tbb::parallel_for(size_t{0}, count, [&](size_t c) {
    CameraSightings& s = out.sightings[c];
    if (s.images == 0 || s.tags > 0) return;
    const std::vector<Frame> looks = Looks(source, frames, c);
    s.mirrored = SeesMirrored(looks, *detectors.local());
    const absl::StatusOr<std::optional<double>> moving = MovingEdgeBlurPx(looks);
    if (moving.ok()) s.moving_edge_px = moving->value_or(0);
  });
  return out;
}

}  // namespace weft
