#include "capture/open_dump.h"

#include "capture/image_folder_dump.h"
#include "capture/recorded_take.h"
#include "capture/take_files.h"

namespace weft {

absl::StatusOr<std::unique_ptr<FrameSource>> OpenDump(const std::string& folder, const Rig& rig) {
  if (IsRecordedTake(folder)) return RecordedTakeDump::Open(folder, rig);
  return ImageFolderDump::Open(folder, rig);
}

}  // namespace weft
