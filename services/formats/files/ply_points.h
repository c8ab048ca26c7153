// Points of a PLY table.
#pragma once

#include <cstddef>

#include "services/formats/files/ply.h"

namespace weft {

// Removes the vertices whose x, y or z is not finite: organized clouds mark places without a measurement so.
// Returns how many they were; 0 where there is no element "vertex".
size_t DropUnmeasured(Ply& ply);

}  // namespace weft
