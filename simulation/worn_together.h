// Several garments as one, for a body that wears them together.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "simulation/wardrobe.h"

namespace weft {

// The innermost first. Their panels lie on one board, each garment's below those of the one before
// (JoinBoards). Names of seams get the garment's name in front. The start shapes must not intersect.
Outfit WearTogether(std::vector<std::pair<std::string, Outfit>> garments);

// A skirt, and a short shirt that hangs over its upper 100 mm.
absl::StatusOr<Outfit> MakeShirtAndSkirt(double cell_mm);

}  // namespace weft
