// Pixels of PNG, JPEG and TIFF files, by libpng, libjpeg and libtiff: what these only warn of is an error
// here where pixels could be made up.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// 8 bits a value, [height][width][channels], channels 1 (grey) or 3 (red, green, blue).
struct DecodedImage {
  int width_px = 0;
  int height_px = 0;
  int channels = 1;
  std::vector<uint8_t> values;
};

enum class JpegOrigin {
  kFile,
  // Cameras often put bytes between the last pixel and the end marker: this warning alone is passed over.
  kCamera,
};

// Baseline and progressive, grey, YCC, RGB and CMYK. Orientation tags are not obeyed. InvalidArgument:
// damaged or truncated, also where pixels could be made up; the message names no file.
absl::StatusOr<DecodedImage> DecodeJpeg(std::span<const uint8_t> bytes,
                                        JpegOrigin origin = JpegOrigin::kFile);

// All kinds; palettes become colours, alpha is left out, 16 bits are scaled to 8 (rounded). InvalidArgument:
// damaged or truncated, checksums included; the message names no file.
absl::StatusOr<DecodedImage> DecodePng(std::span<const uint8_t> bytes);

// Rows, tiles and planes, grey, colour, palettes and what else libtiff converts; alpha is left out, 16 bits
// are scaled to 8 (rounded). Of several images, the first. InvalidArgument: damaged or truncated, or of other
// bits, of more than 4 channels, or of more pixels than `most_pixels`, as libtiff reads the size: a file may
// state it twice. The message names no file.
absl::StatusOr<DecodedImage> DecodeTiff(std::span<const uint8_t> bytes, int64_t most_pixels);

}  // namespace weft
