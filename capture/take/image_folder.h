// What image files a folder holds, by frame and camera.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "base/natural_order.h"
#include "capture/rig/rig.h"

namespace weft {

// [frame][camera id]: path, frames in the order of their names, numbers by value.
using ImageFolder = std::map<std::string, std::map<std::string, std::string>, NaturalOrder>;

// Finds <folder>/<frame>/<camera>.(png|jpg|jpeg|tif|tiff) and <folder>/cam<camera>/image<frame>.(png|...).
// Where a rig is given, a folder cam<x> is one of a camera only if the rig knows it. Names become ids of
// frames and cameras, so they must be plain text (capture/file/plain_text.h). Images of other names are
// left out with a line in `warnings`; without `warnings` they are InvalidArgument. NotFound,
// PermissionDenied.
absl::StatusOr<ImageFolder> ListImageFolder(const std::string& folder, const Rig* rig = nullptr,
                                            std::vector<std::string>* warnings = nullptr);

}  // namespace weft
