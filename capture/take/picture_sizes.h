// Pictures that have not the size of their camera.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/take/image_folder.h"

namespace weft {

struct OddPictures {
  std::map<std::string, std::string> why;  // by path: "is 40x24 pixels, most pictures of c02 are 32x24"
  std::vector<std::string> notes;          // a line for each camera that has such
};

// By the headers of all files; those that cannot be read have no size. A camera's size is that of most of its
// pictures. InvalidArgument: a camera of which fewer than three of four pictures have one size; the message
// has the sizes and frames of both.
absl::StatusOr<OddPictures> FindOddPictures(const ImageFolder& folder);

}  // namespace weft
