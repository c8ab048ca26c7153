// What image files say of themselves before a pixel is decoded.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "absl/status/statusor.h"

namespace weft {

enum class ImageFormat { kPng, kJpeg, kTiff };

struct ImageHeader {
  ImageFormat format = ImageFormat::kPng;
  int width_px = 0;
  int height_px = 0;
  // As TIFF and EXIF number it, 1 to 8: how a viewer should turn the picture. 1 is as it is stored, also
  // where the file does not say. No reader here turns pixels: a calibration refers to them as they are
  // stored.
  int orientation = 1;
};

// By content, not by name. Of a TIFF file with several images, the one that DecodeTiff reads.
// InvalidArgument: none of the three formats, or no size within `bytes`; the message names no file.
absl::StatusOr<ImageHeader> ReadImageHeader(std::span<const uint8_t> bytes);

// The same of a file, of which little is read. Errors of PosixFile, too; the message names the file.
absl::StatusOr<ImageHeader> ReadImageFileHeader(const std::string& path);

// "mirrored", "rotated by 180 degrees", ... of 2 to 8.
std::string OrientationText(int orientation);

}  // namespace weft
