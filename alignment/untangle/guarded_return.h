// Back towards the observed shape without passing through anything.
#pragma once

#include "absl/status/status.h"
#include "alignment/untangle/untangle_patch.h"

namespace weft {

struct ReturnOptions {
  double gap_mm = 0.05;  // kept between faces that come near each other

  absl::Status Validate() const;
};

// Lowers sum_v weight_v |u_v|^2 + sum_edges |u_a - u_b|^2 over the displacements u from the observed
// positions, vertex by vertex. Steps stay within the contact planes of their start, so a patch without
// piercings stays so. A vertex that is stopped by another layer rests on it. A measured one pushes it
// instead, and it what lies behind, until measured vertices are in the way. Faces nearer than gap_mm are
// separated as far as there is room. Returns the iterations.
int ReturnGuarded(const ReturnOptions& options, UntanglePatch* patch);

}  // namespace weft
