// One frame set in memory, as a recording of a single frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/image/raw_frame.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"

namespace weft {

// What a take stores of the pictures of a set, by camera of the rig: size and checksum; 0 where there is
// none.
struct StoredPicture {
  uint64_t bytes = 0, checksum = 0;
};

// Thread safety: const functions may be called from any number of threads.
class SetInMemory : public FrameSource {
 public:
  // Its fingerprint is that of the take that stores such pictures; without `stored`, of one without
  // compression.
  SetInMemory(RawFrameSet set, Rig rig, std::optional<std::vector<StoredPicture>> stored = std::nullopt);

  const std::vector<std::string>& frame_names() const override { return names_; }
  absl::StatusOr<FrameSet> Read(size_t index) const override;
  absl::StatusOr<Frame> ReadView(size_t index, size_t camera) const override;
  absl::StatusOr<std::string> Fingerprint(size_t index) const override;
  const std::vector<std::string>& warnings() const override { return warnings_; }
  std::vector<std::string> unknown_cameras() const override;

 private:
  const RawFrame* FrameOf(const std::string& camera_id) const;

  const RawFrameSet set_;
  const Rig rig_;
  const std::optional<std::vector<StoredPicture>> stored_;
  const std::vector<std::string> names_, warnings_;
};

}  // namespace weft
