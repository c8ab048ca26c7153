// One picture of several files, and what the headers of a dump's files say.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/image_file.h"

namespace weft {

// Of several files of one camera and frame, the picture: the one of the size `expected`, else the one that is
// clearly larger than all others, previews. Sizes are read from the files. InvalidArgument names both files.
absl::StatusOr<std::string> ChoosePicture(const std::vector<std::string>& paths,
                                          const std::optional<ImageSize>& expected);

// A line for each orientation tag that pictures have, with their names; `pictures`: paths by camera or name.
std::vector<std::string> OrientationNotes(const std::map<std::string, std::string>& pictures);

}  // namespace weft
