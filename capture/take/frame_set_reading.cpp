#include "capture/take/frame_set_reading.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {

absl::StatusOr<FrameSet> ReadFrameSet(const FrameSource& source, const Rig& rig, size_t index) {
  const size_t frames = source.frame_names().size();
  if (index >= frames) return absl::OutOfRangeError(absl::StrCat("frame ", index, " of ", frames));
  FrameSet set;
  set.name = source.frame_names()[index];
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    absl::StatusOr<Frame> frame = source.ReadView(index, i);
    if (frame.ok()) {
      set.frames.push_back(*std::move(frame));
    } else {
      set.missing.push_back({rig.cameras[i].id, std::string(frame.status().message())});
    }
  }
  return set;
}

}  // namespace weft
