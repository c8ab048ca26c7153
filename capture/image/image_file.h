// Image files in and out.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/image/image_size.h"

namespace weft {

// Images of more pixels are refused from their header: 256 Mi, such as 16384 x 16384.
inline constexpr int64_t kMaxImagePixels = int64_t{1} << 28;

// Reads PNG, JPEG or TIFF by content, 8 or 16 bits (16 become 8 by ToEightBits), grey or colour. Pixels are
// those that are stored: orientation tags are not obeyed in any format, since calibrations refer to stored
// pixels. A grey file whose pixels are a Bayer mosaic is read as such when `mosaic` or the file (TIFF/EP)
// names the order. camera_id stays empty. NotFound: no such file. InvalidArgument: another format, damaged or
// truncated (also where the decoder would make pixels up), more than kMaxImagePixels, or not of the size that
// the rig says, `expected`. Sizes are checked before pixels are decoded. The message names the file and the
// remedy.
absl::StatusOr<Frame> ReadImageFile(const std::string& path, std::optional<PixelFormat> mosaic = std::nullopt,
                                    std::optional<ImageSize> expected = std::nullopt);

// Writes by the path's ending (png, jpg, tif); `jpeg_quality` 1 to 100. The file appears under its name only
// when it is complete.
absl::Status WriteImageFile(const std::string& path, const Frame& frame, int jpeg_quality = 95);

// Values of 16 bits, [height][width][channels], one channel or red, green and blue.
struct DeepImage {
  int width_px = 0;
  int height_px = 0;
  int channels = 1;
  std::vector<uint16_t> values;
};
// As PNG or TIFF, in the same way. InvalidArgument: another ending, or sizes that do not fit.
absl::Status WriteDeepImageFile(const std::string& path, const DeepImage& image);

}  // namespace weft
