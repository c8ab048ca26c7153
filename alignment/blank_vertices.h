// Vertices without a cell, of which the board says nothing: whether they lie beside their neighbours.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "alignment/mapped_mesh.h"

namespace weft {

// A vertex without a cell or corner is misplaced where an edge of twelve cells' length or more joins it to
// one that has a cell, though the mesh around is fine: another vertex without a cell is three times as near,
// or all other edges of its faces are three times as short. The longest such edges of right templates are 1.7
// cells (a scanned shirt of 101,286 vertices, the presets of `weft simulate`) and 6.6 cells (at the waists of
// skirts that were built from coarse prints, template_check_test). InvalidArgument names the first one.
absl::Status CheckBlankVertices(std::span<const Face> faces, const Mapped& mapped);

}  // namespace weft
