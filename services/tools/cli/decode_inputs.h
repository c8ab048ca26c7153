// The images that `weft decode` is given.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// An image, wherever it is.
struct DecodeInput {
  std::string name;   // the column `image`
  std::string label;  // for messages and the report
  std::function<absl::StatusOr<Frame>()> read;
  std::uintmax_t bytes = 0;  // of its file; the more the longer decoding takes
};

struct DecodeInputs {
  std::vector<DecodeInput> views;
  std::vector<std::string> notes;  // of ListImageFolder, and of tags that are not obeyed
};

// Image files, or all cameras of the frames `frames` (FindFrameRange) where `images` is one take or folder
// of images. Images are then named by camera or, for several frames, as <frame>/<camera>. `mosaic`: the
// order of the Bayer mosaic of grey image files, empty for none. InvalidArgument names the option or the
// file.
absl::StatusOr<DecodeInputs> FindDecodeInputs(const std::vector<std::string>& images,
                                              const std::string& frames, const std::string& mosaic);

}  // namespace weft
