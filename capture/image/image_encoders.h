// Image files in memory, by libpng, libjpeg and libtiff.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// Pixels that somebody else owns: [height][width][channels], channels 1 (grey), 3 (red, green, blue) or, in
// PNG only, 4 (and alpha). Values of 16 bits are in the machine's byte order, 8 bits otherwise.
struct ImagePixels {
  int width_px = 0;
  int height_px = 0;
  int channels = 1;
  int bits = 8;
  std::span<const uint8_t> bytes;
};

enum class PngEffort {
  kFast,   // for files that are written by the thousand
  kSmall,  // for files that are kept or sent
};

// All InvalidArgument: no pixels, sizes that do not fit `bytes`, channels or bits that the format lacks.
// Internal: the library refuses. Messages name no file.
absl::StatusOr<std::vector<uint8_t>> EncodePng(const ImagePixels& image, PngEffort effort = PngEffort::kFast);
// Baseline, colour at half resolution, `quality` 1 to 100, 8 bits.
absl::StatusOr<std::vector<uint8_t>> EncodeJpeg(const ImagePixels& image, int quality);
// Losslessly packed (LZW). `dpi` over 0 is written as the resolution.
absl::StatusOr<std::vector<uint8_t>> EncodeTiff(const ImagePixels& image, double dpi = 0);

// What all three check. `most_channels` and `most_bits`: of the format.
absl::Status CheckPixels(const ImagePixels& image, int most_channels, int most_bits);

}  // namespace weft
