// Where a mesh passes through itself.
#pragma once

#include <Eigen/Core>
#include <compare>
#include <optional>
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

// Where the segment from p to q passes through the triangle, as its share of the way from p; touching counts.
// Nothing for segments that lie in the triangle's plane.
std::optional<double> SegmentThroughTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                                             const Eigen::Vector3d (&t)[3]);

// All pairs of faces that intersect and share no vertex, ordered by a, then b. Candidates come from a uniform
// grid. Vertices must be finite and faces valid. Runs in the calling thread's TBB arena; the same result at
// any thread count.
std::vector<FacePair> FindSelfIntersections(const std::vector<Eigen::Vector3d>& vertices_mm,
                                            const std::vector<Face>& faces);

struct IntersectingPairs {
  std::vector<FacePair> apart;      // share no vertex
  std::vector<FacePair> at_vertex;  // share one vertex and meet elsewhere too

  size_t count() const { return apart.size() + at_vertex.size(); }
  bool empty() const { return count() == 0; }
};

// Like FindSelfIntersections, but stricter. It includes faces around a common vertex, and pairs that meet
// only once the vertices are rounded to 32-bit floats, as in files. Neighbours across an edge meet outside
// it only when folded flat, and are ignored.
IntersectingPairs FindIntersectingPairs(const std::vector<Eigen::Vector3d>& vertices_mm,
                                        const std::vector<Face>& faces);

// The same where only vertices that `moved` ([vertices]) are elsewhere than when `before` was found; looks at
// the pairs of their faces alone.
IntersectingPairs FindIntersectingPairsAgain(const std::vector<Eigen::Vector3d>& vertices_mm,
                                             const std::vector<Face>& faces, const IntersectingPairs& before,
                                             const std::vector<bool>& moved);

}  // namespace weft
