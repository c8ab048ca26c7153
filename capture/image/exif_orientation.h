// The orientation in EXIF data, which JPEG and PNG files carry.
#pragma once

#include <cstdint>
#include <span>

namespace weft {

// Of a TIFF structure ("II" or "MM", 42, ...), its first directory's tag 274: 1 to 8, 1 where there is none.
int OrientationInExif(std::span<const uint8_t> exif);

}  // namespace weft
