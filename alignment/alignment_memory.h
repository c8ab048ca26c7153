// What Align needs besides its model and its result.
#pragma once

#include "alignment/align.h"

namespace weft {

// Bytes of the arrays that the elastic stages hold at once for so many vertices: problem, deformation, and
// the solver's fields. The factors of the fill and of the preconditioner come on top: about 0.3 KiB per
// hidden vertex.
size_t AlignmentMemoryBytes(int vertices);

}  // namespace weft
