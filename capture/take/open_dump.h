// Dumps of any kind by their folder.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"

namespace weft {

// A recorded take or a folder of images, whichever stands there. `mosaic`: the order of the Bayer mosaic that
// grey image files hold, MosaicFromName; empty for none. Errors of RecordedTakeDump, ImageFolderDump or
// MosaicFromName; InvalidArgument: a mosaic for a take, whose cameras say how their pixels lie.
absl::StatusOr<std::unique_ptr<FrameSource>> OpenDump(const std::string& folder, const Rig& rig,
                                                      const std::string& mosaic = "");

}  // namespace weft
