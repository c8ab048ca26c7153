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
  // Measured vertices move by at most this many times their sigma_mm until 20 pushes have not helped;
  // then those that contradict each other may move freely, and after as many again all that take part in a
  // tangle.
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

// Moves vertices near self-intersections until there are none; all others keep their bytes. Around each place
// a patch is cut out. Regions on the wrong side of another layer are found from the contours and pushed back
// through it; folds that have turned inside out are laid flat; what is left shortens its contour, and is laid
// flat after a while (cut_off_regions.h, untangle_push.h). Once the patch is clean it returns as near to
// where it was as it can without passing through anything (guarded_return.h), so the last step can not undo
// the first. Moved vertices are rounded to 32-bit floats.
//
// Lower `sigma_mm` ([vertices], positive, or empty) holds a vertex more firmly to its place. A patch that
// does not come clean keeps the better of its states, and pairs_after tells so: this is not an error.
// InvalidArgument for options, vertices that are not finite, faces that are no triangles of them and sigmas
// that are not positive, each named. The search runs in the calling thread's TBB arena, the patches one after
// the other in the calling thread; the same bytes at any thread count.
absl::StatusOr<UntangleReport> RemoveSelfIntersections(const std::vector<Face>& faces,
                                                       std::span<const float> sigma_mm,
                                                       const UntangleOptions& options,
                                                       std::vector<Eigen::Vector3d>* vertices_mm);

// The same for a registered mesh, whose inferred vertices make way for the measured ones: these stay within
// options.max_observed_sigmas of their sigma_mm, and of those for which no place was found there the state
// becomes kInferred, without views, and the move is added to sigma_mm in quadrature.
absl::StatusOr<UntangleReport> RemoveSelfIntersections(const std::vector<Face>& faces,
                                                       const UntangleOptions& options, RegisteredMesh* mesh);

}  // namespace weft
