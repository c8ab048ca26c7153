#include "capture/image/mosaic.h"

#include <cstdlib>
#include <string>

#include "absl/strings/str_cat.h"

namespace weft {

absl::StatusOr<std::optional<PixelFormat>> MosaicFromName(std::string_view name) {
  if (name.empty()) return std::nullopt;
  const absl::StatusOr<PixelFormat> format = PixelFormatFromName(name);
  if (format.ok() && *format != PixelFormat::kGrey8 && *format != PixelFormat::kRgb8) return *format;
  return absl::InvalidArgumentError(
      absl::StrCat("mosaic ", std::string(name),
                   " is no order of a Bayer mosaic; it is bayer_rg8, bayer_gr8, bayer_gb8 or bayer_bg8"));
}

bool LooksLikeMosaic(const Frame& frame) {
  if (frame.format != PixelFormat::kGrey8 || frame.width_px < 3 || frame.height_px < 3) return false;
  // Ordinary pictures differ less from neighbour to neighbour than from there to the next; noise of single
  // pixels makes both alike.
  constexpr double kClearly = 1.2;
  int64_t first = 0, second = 0;
  for (int y = 0; y + 2 < frame.height_px; ++y) {
    const uint8_t *row = frame.row(y), *below = frame.row(y + 1), *below_that = frame.row(y + 2);
    for (int x = 0; x + 2 < frame.width_px; ++x) {
      first += std::abs(row[x] - row[x + 1]) + std::abs(row[x] - below[x]);
      second += std::abs(row[x] - row[x + 2]) + std::abs(row[x] - below_that[x]);
    }
  }
  return static_cast<double>(first) > kClearly * static_cast<double>(second);
}

}  // namespace weft
