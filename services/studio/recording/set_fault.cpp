#include "services/studio/recording/set_fault.h"

#include "absl/strings/str_cat.h"

namespace weft {

std::string FaultOfSet(const RawFrameSet& set, const std::vector<std::string>& camera_ids,
                       const std::optional<uint64_t>& last) {
  if (last && set.number <= *last) return absl::StrCat("its number is not after ", *last);
  for (const std::string& id : camera_ids) {
    int times = 0;
    for (const RawFrame& frame : set.frames) times += frame.camera_id == id;
    for (const MissingFrame& missing : set.missing) times += missing.camera_id == id;
    if (times != 1) return absl::StrCat("it accounts for camera ", id, " ", times, " times");
  }
  for (const RawFrame& frame : set.frames)
    if (absl::Status status = frame.Validate(); !status.ok()) return std::string(status.message());
  return "";
}

}  // namespace weft
