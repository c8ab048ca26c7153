// What a synthetic take was filmed with.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "simulation/synthetic_take.h"

namespace weft {

// Writes rig.json, board.json, board.png, template/ and panels.png into the folder (made where it is
// missing). Errors of WriteFileAtomically.
absl::Status WriteStudio(const SyntheticTake& take, const std::string& folder);

}  // namespace weft
