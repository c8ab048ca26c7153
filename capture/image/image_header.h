// What image files say of themselves before a pixel is decoded.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"

namespace weft {

enum class ImageFormat { kPng, kJpeg, kTiff };

struct ImageHeader {
  ImageFormat format = ImageFormat::kPng;
  int width_px = 0;
  int height_px = 0;
};

// By content, not by name. Of a TIFF file with several images, the first. InvalidArgument: none of the three
// formats, or no size within `bytes`; the message names no file.
absl::StatusOr<ImageHeader> ReadImageHeader(std::span<const uint8_t> bytes);

}  // namespace weft
