// Back towards the observed shape without passing through anything.
#pragma once

#include "absl/status/status.h"
#include "alignment/untangle/untangle_patch.h"

namespace weft {

struct ReturnOptions {
  double gap_mm = 0.05;  // kept between faces that come near each other

  absl::Status Validate() const;
};

// Lowers sum_v weight_v |u_v|^2 + sum_edges |u_a - u_b|^2 over the displacements u from the
// observed positions, vertex by vertex, by steps that stay within the contact planes of where they start: a
// patch without piercings keeps none. Who is held up by another layer rests on it and does not push it. Faces
// nearer than gap_mm are parted as far as there is room. Returns the iterations.
int ReturnGuarded(const ReturnOptions& options, UntanglePatch* patch);

}  // namespace weft
