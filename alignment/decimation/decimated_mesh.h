// Fewer vertices of a mesh whose topology is the same in all frames.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

struct DecimatedMesh {
  std::vector<int> vertices;  // those of the mesh that are kept, ascending
  std::vector<Face> faces;    // indices into `vertices`
};

// At most `max_vertices` of the mesh's own vertices, spread evenly over its surface, and faces between them.
// Cloth that is flat in this frame folds in another one: so evenness counts, not this frame's shape. Faces
// keep their orientation, openings and seams stay. The same for the same mesh. By meshoptimizer, quadric
// error metrics (Garland and Heckbert 1997). InvalidArgument: faces with indices outside the vertices,
// positions that are not finite (each named), no faces, `max_vertices` below 3.
// `places`: of each vertex on the print, or empty; as FlipBadEdges takes them, which mends slivers and folds.
absl::StatusOr<DecimatedMesh> DecimateMesh(const TriangleMesh& mesh, size_t max_vertices,
                                           const std::vector<Eigen::Vector2f>& places = {});

}  // namespace weft
