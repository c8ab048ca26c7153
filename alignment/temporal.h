// Refinement over neighbouring frames (paper, section 5.4.2, Eq. 5), as Jacobi passes. A frame's result
// depends only on the states of the previous pass, so frames can be refined in any order.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/align.h"

namespace weft {

struct TemporalOptions {
  // Of E_Smooth against E_Dist, for vertices whose pull is as sure as reference_sigma_mm.
  double weight = 0.1;
  double reference_sigma_mm = 1;
  // Eq. 5 gives the mean of both neighbours and the frame's own state half each. With this set, each counts
  // by its variance instead: cloth that both neighbours observed outweighs what the frame alone inferred.
  bool weigh_by_sigma = true;
  // What three frames measured differs from even motion by the cloth's acceleration, which is alike over
  // three rings of vertices, and by noise, which is not. Hidden vertices accelerate with the
  // cloth around them. The noise of observed ones is shared out over the three frames; they move by at most
  // max_observed_sigmas of their sigma_mm, 0 leaves them where they are.
  double max_observed_sigmas = 1;
  RayFit rays;
  ElasticOptions elastic;
  bool remove_self_intersections = true;  // last, since moved vertices may meet other layers anew
  UntangleOptions untangle;

  absl::Status Validate() const;
};

struct TemporalResult {
  RegisteredMesh mesh;
  UntangleReport untangling;  // all zero where it was not asked for
};

// One pass for one frame. Hidden vertices minimise E_Smooth + lambda E_Dist. Where that is surer than both
// neighbours together, E_Smooth draws them to where one neighbour measured them, moved with the cloth around.
// Observed ones move by at most max_observed_sigmas of their sigma_mm, which is kept, unless a
// self-intersection is removed there. All three meshes are of the pass before and have the template's
// vertices. InvalidArgument: options, or meshes of another size. Otherwise as Align. The same result at any
// thread count.
absl::StatusOr<TemporalResult> RefineInTime(const AlignmentModel& model, const RegisteredMesh& previous,
                                            const RegisteredMesh& own, const RegisteredMesh& next,
                                            const TemporalOptions& options,
                                            const std::vector<RayTarget>& rays = {},
                                            const CancelCheck& cancelled = nullptr);

// A frame that could not be registered, from the registered ones around it: positions in between by time,
// then relaxed by E_Dist. Every vertex has state kBridged, no views, and a sigma that grows with the way that
// it moved in between.
struct Gap {
  int frames_since_previous = 1, frames_to_next = 1;  // at least 1
};
absl::StatusOr<TemporalResult> BridgeInTime(const AlignmentModel& model, const RegisteredMesh& previous,
                                            const RegisteredMesh& next, const Gap& gap,
                                            const TemporalOptions& options,
                                            const CancelCheck& cancelled = nullptr);

}  // namespace weft
