// Bayer mosaics in image files, which call them grey.
#pragma once

#include <optional>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// The order of a mosaic by its name, "bayer_rg8", "bayer_gr8", "bayer_gb8" or "bayer_bg8"; empty: none.
// InvalidArgument lists the names.
absl::StatusOr<std::optional<PixelFormat>> MosaicFromName(std::string_view name);

// Whether the pixels of a grey frame alternate as those of a mosaic do: more like their second neighbours
// than like their first. False for other formats, and for pictures without colour, where nothing tells.
bool LooksLikeMosaic(const Frame& frame);

}  // namespace weft
