// Planes between corners, sides and faces that come near each other: whoever stays on its own side of all of
// them passes through nothing.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "alignment/untangle/untangle_patch.h"

namespace weft {

// A vertex may move by at most room_mm against the normal. Room below 0 asks for a move along it.
struct ContactPlane {
  int vertex = 0, contact = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // length 1, towards the vertex's own side
  double room_mm = 0;
};

// A vertex and a face, or two edges, that come near each other.
struct Contact {
  std::array<int, 4> vertices;  // those of one of both first
  int ones = 1;

  // The vertices on the other side of the plane.
  std::span<const int> Opposite(int vertex) const {
    const std::span<const int> all(vertices);
    const std::span<const int> these = all.first(ones), those = all.subspan(ones);
    return std::find(these.begin(), these.end(), vertex) != these.end() ? those : these;
  }
};

struct ContactPlanes {
  std::vector<int> first;            // [free + 1]
  std::vector<ContactPlane> planes;  // ordered by vertex
  std::vector<Contact> contacts;
};

// One plane half-way between the nearest points of each vertex and face, and of each two edges. Pairs have
// no common vertex, lie within reach_mm and have a vertex that `moves` ([n], free ones only); planes of
// such vertices alone are listed. Vertices may move in a straight line by up to reach_mm / 2 and up to
// their room in all their planes (0 for those below 0). No two elements then meet on the way, since each
// stays within its half-space (separating planes of convex sets). The room leaves gap_mm between them.
ContactPlanes FindContactPlanes(const UntanglePatch& patch, const std::vector<bool>& moves, double reach_mm,
                                double gap_mm);

}  // namespace weft
