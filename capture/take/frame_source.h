// The one interface through which the stages read recordings, of whatever kind.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// Where the bytes of an image lie: a file, or a part of one.
struct StoredView {
  std::string file;
  uint64_t offset_bytes = 0, bytes = 0;
};

// Random access over the frames of a recording.
// Thread safety: Read may be called from several threads.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Names of all frames, in order of time.
  virtual const std::vector<std::string>& frame_names() const = 0;

  // Reads frame `index` of frame_names(). A camera whose image is absent, unreadable or of another size than
  // the rig says is listed in `missing` with the reason; the others are delivered.
  // OutOfRange: no such frame.
  virtual absl::StatusOr<FrameSet> Read(size_t index) const = 0;

  // Reads one image of the frame, so that the views of a large rig need not be in memory together. `camera`
  // is the position in the rig that the source was opened with.
  // OutOfRange: no such frame or camera. Any other error is the reason that Read would list in `missing`.
  virtual absl::StatusOr<Frame> ReadView(size_t index, size_t camera) const = 0;

  // For whoever copies recordings: where the bytes of an image lie, and ReadView from a file that holds them
  // alone. Errors of ReadView; Unimplemented: a source without files.
  virtual absl::StatusOr<StoredView> Locate(size_t /*index*/, size_t /*camera*/) const {
    return absl::UnimplementedError("no files");
  }
  virtual absl::StatusOr<Frame> ReadCopy(const std::string& /*copy*/, size_t /*index*/,
                                         size_t /*camera*/) const {
    return absl::UnimplementedError("no files");
  }

  // 16 hex digits that change when the recorded images of the frame change; reads no pixels.
  // OutOfRange: no such frame.
  virtual absl::StatusOr<std::string> Fingerprint(size_t index) const = 0;

  // What an operator should know of the recording as a whole, in words: cameras that one side lacks, an index
  // that a crash cut short.
  virtual const std::vector<std::string>& warnings() const = 0;

  // Cameras of the recording that the rig lacks: their images are not read.
  virtual std::vector<std::string> unknown_cameras() const { return {}; }

  // When a camera's image of a frame was taken, and the moment that the frame stands for, on one axis.
  // Nothing where there is none, or where the times of cameras do not compare.
  virtual std::optional<int64_t> ViewTime_ns(size_t /*index*/, size_t /*camera*/) const {
    return std::nullopt;
  }
  virtual std::optional<int64_t> FrameTime_ns(size_t /*index*/) const { return std::nullopt; }
};

}  // namespace weft
