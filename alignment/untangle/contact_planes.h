// Planes between corners, sides and faces that come near each other: whoever stays on its own side of all of
// them passes through nothing.
#pragma once

#include <vector>

#include "alignment/untangle/untangle_patch.h"

namespace weft {

// A vertex may move by at most room_mm against the normal. Room below 0 asks for a move along it.
struct ContactPlane {
  int vertex = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // length 1, towards the vertex's own side
  double room_mm = 0;
};

struct ContactPlanes {
  std::vector<int> first;            // [free + 1]
  std::vector<ContactPlane> planes;  // ordered by vertex
};

// One plane half-way between the nearest points of each vertex and face, and of each two edges. Pairs have
// no common vertex, lie within reach_mm and have a vertex that `moves` ([n], free ones only); planes of
// such vertices alone are listed. Vertices may move in a straight line by up to reach_mm / 2 and up to
// their room in all their planes (0 for those below 0). No two elements then meet on the way, since each
// stays within its half-space (separating planes of convex sets). The room leaves gap_mm between them.
ContactPlanes FindContactPlanes(const UntanglePatch& patch, const std::vector<bool>& moves, double reach_mm,
                                double gap_mm);

}  // namespace weft
