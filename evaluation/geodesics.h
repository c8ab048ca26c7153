// Exact geodesic distances on triangle meshes.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

// Shortest paths over the faces of a mesh from one vertex to all others. The algorithm is that of Chen and
// Han (1990) with the window filter and the priority queue of Xin and Wang (2009). It is exact for the
// polyhedron up to rounding. Immutable; any number of threads may use it at once.
class GeodesicMesh {
 public:
  // InvalidArgument: faces with invalid indices, an edge with more than two faces, vertices that are not
  // finite (each named).
  static absl::StatusOr<GeodesicMesh> Build(const std::vector<Eigen::Vector3d>& vertices_mm,
                                            const std::vector<Face>& faces);

  // [vertices], infinity where no path leads. `source` must be a vertex. About 15 us per vertex on one core,
  // a hundred bytes per window of which there are some tens per vertex.
  std::vector<double> DistancesFrom(int source) const;

 private:
  friend class WindowPropagation;

  // Halfedge 3 f + i runs from corner i of face f to the next one; its opposite corner is the third.
  struct HalfEdge {
    int from = 0, to = 0, opposite = 0;  // vertices
    int twin = -1;                       // of the face beyond, -1 at the border
    double length_mm = 0;
    // Opposite corner with `from` at the origin, `to` on the x axis and the face above it.
    double opposite_x = 0, opposite_y = 0;
  };

  std::vector<HalfEdge> halfedges_;
  std::vector<int> first_;      // [vertices + 1] into outgoing_
  std::vector<int> outgoing_;   // halfedges opposite to the vertex, one per face around it
  std::vector<bool> branches_;  // [vertices]; shortest paths may bend there: saddles and border
};

}  // namespace weft
