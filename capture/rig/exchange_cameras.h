// Cameras of a rig whose names were exchanged, by their cables or in a file.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

// For each camera of the rig, the one whose model it gets: of `ids` each gets that of the next, the last that
// of the first; all others keep theirs. InvalidArgument: fewer than two, one that the rig lacks or that is
// given twice, images of different sizes.
absl::StatusOr<std::vector<size_t>> ExchangedPlaces(const Rig& rig, const std::vector<std::string>& ids);

// The rig with models as `places` says. Names and their order stay.
Rig WithPlaces(const Rig& rig, const std::vector<size_t>& places);

}  // namespace weft
