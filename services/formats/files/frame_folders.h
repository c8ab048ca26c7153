// The folders of a result, one per frame.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/formats/files/frame_paths.h"

namespace weft {

// Names of the folders of `result` that hold such a file, in their natural order, but for templates.
// NotFound, PermissionDenied: the folder cannot be listed.
absl::StatusOr<std::vector<std::string>> ListFrameFolders(const std::string& result,
                                                          FrameFile file = FrameFile::kMesh);

}  // namespace weft
