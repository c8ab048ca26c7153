// Dumps of any kind by their folder.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "capture/frame_source.h"
#include "capture/rig.h"

namespace weft {

// A recorded take or a folder of images, whichever stands there. Errors of RecordedTakeDump or
// ImageFolderDump.
absl::StatusOr<std::unique_ptr<FrameSource>> OpenDump(const std::string& folder, const Rig& rig);

}  // namespace weft
