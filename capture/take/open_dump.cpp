#include "capture/take/open_dump.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/mosaic.h"
#include "capture/take/image_folder_dump.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_files.h"

namespace weft {

absl::StatusOr<std::unique_ptr<FrameSource>> OpenDump(const std::string& folder, const Rig& rig,
                                                      const std::string& mosaic) {
  WEFT_ASSIGN_OR_RETURN(const std::optional<PixelFormat> order, MosaicFromName(mosaic));
  if (!IsRecordedTake(folder)) return ImageFolderDump::Open(folder, rig, {.mosaic = order});
  if (order) {
    return absl::InvalidArgumentError(absl::StrCat(
        folder, ": a mosaic is named for folders of images; the cameras of a take say how their pixels lie"));
  }
  return RecordedTakeDump::Open(folder, rig);
}

}  // namespace weft
