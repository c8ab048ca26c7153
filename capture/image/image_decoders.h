// Pixels of PNG, JPEG and TIFF files, by libpng, libjpeg and libtiff: what these only warn of is an error
// here where pixels could be made up.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/image/image_header.h"

namespace weft {

// 8 bits a value, [height][width][channels], channels 1 (grey) or 3 (red, green, blue).
struct DecodedImage {
  int width_px = 0;
  int height_px = 0;
  int channels = 1;
  std::vector<uint8_t> values;
  // The file says that its grey values are a Bayer mosaic: its order, where it names one.
  bool is_mosaic = false;
  std::optional<PixelFormat> mosaic = std::nullopt;
};

enum class JpegOrigin {
  kFile,
  // Cameras often put bytes between the last pixel and the end marker: this warning alone is passed over.
  kCamera,
};

// Baseline and progressive, grey, YCC, RGB and CMYK. Orientation tags are not obeyed. What libjpeg skips
// before the pixels, metadata of a wrong length, does no harm. InvalidArgument: damaged or truncated, also
// where pixels could be made up; the message names no file.
absl::StatusOr<DecodedImage> DecodeJpeg(std::span<const uint8_t> bytes,
                                        JpegOrigin origin = JpegOrigin::kFile);
// What precedes the pixels. The same errors.
absl::StatusOr<ImageHeader> ReadJpegHeader(std::span<const uint8_t> bytes);

// All kinds; palettes become colours, alpha is left out, 16 bits become 8 by ToEightBits. Chunks of
// metadata with a wrong checksum do no harm. InvalidArgument: damaged or truncated, checksums of what makes
// the pixels included; the message names no file.
absl::StatusOr<DecodedImage> DecodePng(std::span<const uint8_t> bytes);

// Rows, tiles and planes alike: grey, colour, Bayer mosaics, and palettes and colour spaces that libtiff
// converts. Alpha is left out, orientation tags are not obeyed, 16 bits become 8 by ToEightBits. Grey of 3
// values or more is colour, as programs write it that forget the label. Of several images, the picture of
// full resolution (tiff_picture.h). InvalidArgument: damaged or truncated, of a kind that is not read, which
// is named, or of more pixels than `most_pixels`, as libtiff reads the size. The message names no file.
absl::StatusOr<DecodedImage> DecodeTiff(std::span<const uint8_t> bytes, int64_t most_pixels);

}  // namespace weft
