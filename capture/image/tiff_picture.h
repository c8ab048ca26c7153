// Which of the images in a TIFF file is the picture.
#pragma once

#include <tiffio.h>

#include <cstdint>

#include "absl/status/statusor.h"

namespace weft {

struct TiffPicture {
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  int orientation = 1;  // 1 to 8, as ImageHeader has it
};

// Makes the picture of full resolution the current directory of `tiff`. Thumbnails and levels of pyramids are
// passed over, by their label (NewSubfileType, also in SubIFDs) or since they are clearly smaller, and so are
// masks. InvalidArgument: several pictures of full resolution, a camera's raw file (DNG), or a directory that
// cannot be read; the message names no file.
absl::StatusOr<TiffPicture> FindTiffPicture(TIFF* tiff);

}  // namespace weft
