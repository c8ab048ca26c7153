#include "services/work/animation/set_in_memory.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/file/checksum.h"
#include "capture/file/content_hash.h"
#include "capture/image/image_size.h"
#include "capture/take/frame_set_reading.h"
#include "capture/take/recorded_take.h"

namespace weft {

SetInMemory::SetInMemory(RawFrameSet set, Rig rig, std::optional<std::vector<StoredPicture>> stored)
    : set_(std::move(set)),
      rig_(std::move(rig)),
      stored_(std::move(stored)),
      names_{FrameNameOf(set_.number)} {}

absl::StatusOr<FrameSet> SetInMemory::Read(size_t index) const { return ReadFrameSet(*this, rig_, index); }

absl::StatusOr<Frame> SetInMemory::ReadView(size_t index, size_t camera) const {
  if (index > 0 || camera >= rig_.cameras.size()) return absl::OutOfRangeError("no such frame or camera");
  const CameraModel& model = rig_.cameras[camera];
  const RawFrame* raw = FrameOf(model.id);
  if (raw == nullptr) {
    for (const MissingFrame& missing : set_.missing)
      if (missing.camera_id == model.id) return absl::NotFoundError(missing.reason);
    return absl::NotFoundError("no stream in the take");
  }
  const WrongSize sizes{{raw->width_px, raw->height_px}, {model.width_px, model.height_px}};
  if (sizes.found != sizes.expected)
    return WrongSizeError(absl::StrCat("camera ", model.id, ", frame ", names_[0]), sizes);
  absl::StatusOr<Frame> frame = ToFrame(*raw, DeepBits::kUsed);
  if (frame.ok()) frame->origin = absl::StrCat("camera ", model.id, ", frame ", names_[0]);
  return frame;
}

// As RecordedTakeDump has it.
absl::StatusOr<std::string> SetInMemory::Fingerprint(size_t index) const {
  if (index > 0) return absl::OutOfRangeError("no such frame");
  ContentHash hash;
  hash.Add(names_[0]);
  for (size_t camera = 0; camera < rig_.cameras.size(); ++camera) {
    const RawFrame* raw = FrameOf(rig_.cameras[camera].id);
    StoredPicture stored;
    if (stored_) {
      stored = (*stored_)[camera];
    } else if (raw != nullptr) {
      stored = {raw->bytes->size(), Checksum(raw->bytes->data(), raw->bytes->size())};
    }
    hash.Add(rig_.cameras[camera].id);
    hash.AddInteger(stored.bytes);
    hash.AddInteger(stored.checksum);
  }
  return hash.Hex();
}

std::vector<std::string> SetInMemory::unknown_cameras() const {
  std::vector<std::string> unknown;
  const auto add = [&](const std::string& id) {
    if (rig_.IndexOf(id) < 0) unknown.push_back(id);
  };
  for (const RawFrame& frame : set_.frames) add(frame.camera_id);
  for (const MissingFrame& missing : set_.missing) add(missing.camera_id);
  std::ranges::sort(unknown);
  return unknown;
}

const RawFrame* SetInMemory::FrameOf(const std::string& camera_id) const {
  const auto found =
      std::ranges::find_if(set_.frames, [&](const RawFrame& frame) { return frame.camera_id == camera_id; });
  return found == set_.frames.end() ? nullptr : &*found;
}

}  // namespace weft
