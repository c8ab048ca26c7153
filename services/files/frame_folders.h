// The folders of a result, one per frame.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "services/files/frame_paths.h"

namespace weft {

// Numbers in names by their value, so that frame 9 comes before frame 10.
bool NaturallyBefore(std::string_view a, std::string_view b);

// Names of the folders of `result` that hold such a file, in their natural order. NotFound,
// PermissionDenied: the folder cannot be listed.
absl::StatusOr<std::vector<std::string>> ListFrameFolders(const std::string& result,
                                                          FrameFile file = FrameFile::kMesh);

}  // namespace weft
