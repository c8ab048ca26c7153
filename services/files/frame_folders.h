// The folders of a result, one per frame.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// Numbers in names by their value, so that frame 9 comes before frame 10.
bool NaturallyBefore(std::string_view a, std::string_view b);

// Names of the folders of `result` that hold a file `file`, in their natural order. NotFound,
// PermissionDenied: the folder cannot be listed.
absl::StatusOr<std::vector<std::string>> ListFrameFolders(const std::string& result,
                                                          const std::string& file = "mesh.ply");

}  // namespace weft
