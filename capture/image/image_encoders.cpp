#include "capture/image/image_encoders.h"

#include "absl/strings/str_cat.h"

namespace weft {

absl::Status CheckPixels(const ImagePixels& image, int most_channels, int most_bits) {
  const bool has_channels =
      image.channels == 1 || image.channels == 3 || (image.channels == 4 && most_channels == 4);
  const bool has_bits = image.bits == 8 || (image.bits == 16 && most_bits == 16);
  if (image.width_px > 0 && image.height_px > 0 && has_channels && has_bits &&
      image.bytes.size() == static_cast<size_t>(image.width_px) * image.height_px * image.channels *
                                (static_cast<size_t>(image.bits) / 8))
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(image.bytes.size(), " bytes for ", image.width_px, " x ",
                                                 image.height_px, " pixels of ", image.channels,
                                                 " channels of ", image.bits, " bits"));
}

}  // namespace weft
