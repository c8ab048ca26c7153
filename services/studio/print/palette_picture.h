// A picture of how well inks separate.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "pattern/image/ink_palette.h"

namespace weft {

// A PNG with the inks as they were seen and a table of their separations, weak ones marked.
absl::Status WritePalettePicture(const PaletteReport& report, const std::string& path);

// Below this two inks are easily mistaken for each other; above kSafeSeparation hardly ever.
inline constexpr double kWeakSeparation = 4, kSafeSeparation = 6;

}  // namespace weft
