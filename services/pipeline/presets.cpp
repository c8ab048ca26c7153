#include "services/pipeline/presets.h"

#include <string>

#include "absl/strings/str_cat.h"

namespace weft {

absl::StatusOr<AlignOptions> PresetByName(std::string_view name) {
  if (name.empty() || name == "best") return BestPreset();
  if (name == "paper") return PaperPreset();
  return absl::InvalidArgumentError(
      absl::StrCat("preset \"", std::string(name.substr(0, 64)), "\" is unknown; it is best or paper"));
}

}  // namespace weft
