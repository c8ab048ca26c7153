// Where a mesh passes through itself.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

struct FacePair {
  int a = 0, b = 0;  // a < b

  auto operator<=>(const FacePair&) const = default;
};

// True if the triangles have a point in common; touching counts. A triangle without area is the segment or
// point that it covers. By separating axes in double precision: gaps down to about 1e-15 of the coordinates'
// size are seen.
bool TrianglesIntersect(const Eigen::Vector3d (&s)[3], const Eigen::Vector3d (&t)[3]);

// All pairs of faces that intersect and share no vertex, ordered by a, then b. Candidates come from a uniform
// grid. Vertices must be finite and faces valid. Runs in the calling thread's TBB arena; the same result at
// any thread count.
std::vector<FacePair> FindSelfIntersections(const std::vector<Eigen::Vector3d>& vertices_mm,
                                            const std::vector<Face>& faces);

}  // namespace weft
