// Takes a mesh out of itself (paper, section 5.4, "Solving Self-Intersections"), leaving the rest untouched.
#pragma once

#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/untangle/guarded_return.h"

namespace weft {

struct UntangleOptions {
  int max_pushes = 60;  // iterations that push layers apart, per patch
  // Observed vertices move by at most this many times their sigma_mm for 20 pushes. After these, those
  // that contradict each other may move freely; after 20 more, all in an intersecting region.
  double max_observed_sigmas = 3;
  int max_rounds = 4;  // searches of the whole mesh; patches grow from round to round
  ReturnOptions back;

  absl::Status Validate() const;
};

struct UntangleReport {
  // Pairs of faces that intersect: those that share no vertex, and those around a common vertex. Exact
  // counts, over the whole mesh, of the positions as they are and as they will be when stored as 32-bit
  // floats.
  int pairs_before = 0, pairs_after = 0;
  int vertex_pairs_before = 0, vertex_pairs_after = 0;
  int patches = 0;  // places worked on, over all rounds
  int rounds = 0;
  int pushes = 0, returns = 0;  // iterations, over all patches
  int moved_vertices = 0;
  int demoted_vertices = 0;                  // measured ones that moved further than they may, now inferred
  double max_move_mm = 0, mean_move_mm = 0;  // of the moved vertices
};

// Moves vertices near self-intersections until there are none; all others keep their bytes. Around each
// self-intersection a patch is cut out. Regions on the wrong side of another layer are found from the
// contours and pushed back through it. Folds that have turned inside out are flattened. Remaining contours
// are shortened, and flattened after some iterations (cut_off_regions.h, untangle_push.h). A clean patch
// then returns towards its original position without new intersections; measured vertices push others on
// their way (guarded_return.h). In the end, what is not where it belongs yet returns once more. Moved
// vertices are rounded to 32-bit floats.
//
// A lower `sigma_mm` ([vertices], positive, or empty) holds a vertex more firmly to its position. A patch
// that remains intersecting keeps the better of its states, and pairs_after counts it: this is not an
// error. InvalidArgument names invalid options, non-finite vertices, invalid faces and sigmas that are not
// positive. The search runs in the calling thread's TBB arena, the patches one after the other in the
// calling thread. The same bytes at any thread count.
absl::StatusOr<UntangleReport> RemoveSelfIntersections(const std::vector<Face>& faces,
                                                       std::span<const float> sigma_mm,
                                                       const UntangleOptions& options,
                                                       std::vector<Eigen::Vector3d>* vertices_mm);

// The same for a registered mesh, whose inferred vertices yield to the observed ones. These stay within
// options.max_observed_sigmas of their sigma_mm. An observed vertex for which that is impossible becomes
// kInferred, without views, and its displacement is added to sigma_mm in quadrature.
absl::StatusOr<UntangleReport> RemoveSelfIntersections(const std::vector<Face>& faces,
                                                       const UntangleOptions& options, RegisteredMesh* mesh);

}  // namespace weft
