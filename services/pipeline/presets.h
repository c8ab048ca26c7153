// Names of the alignment's presets.
#pragma once

#include <string_view>

#include "absl/status/statusor.h"
#include "alignment/align.h"

namespace weft {

// "best" (also when empty) or "paper"; InvalidArgument lists the names.
absl::StatusOr<AlignOptions> PresetByName(std::string_view name);

}  // namespace weft
