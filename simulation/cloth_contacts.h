// Where layers of a cloth come near each other, and how far they may move without passing through.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// A vertex near a face (v = vertex, then the face's) or two edges near each other (v = one's ends, then the
// other's), sharing no vertex.
struct ContactPair {
  std::array<int, 4> v;
  std::array<float, 4> weight;  // sum of weight times position = vector between the nearest points
  Eigen::Vector3d normal;       // unit, from the face or second edge to the first
  float distance_mm = 0;
  bool is_edges = false;
  bool is_near = false;  // neighbours in the sheet: a vertex of one is joined to a vertex of the other
};

class ContactFinder {
 public:
  ContactFinder(int vertices, const std::vector<Face>& faces);

  // All pairs nearer than `reach_mm`, in a fixed order. Parallel in the calling thread's TBB arena, the same
  // result at any thread count.
  std::vector<ContactPair> Find(const std::vector<Eigen::Vector3d>& x_mm, double reach_mm) const;

 private:
  void FindAtFaces(const std::vector<Eigen::Vector3d>& x_mm, double reach_mm,
                   std::vector<ContactPair>& out) const;
  void FindAtEdges(const std::vector<Eigen::Vector3d>& x_mm, double reach_mm,
                   std::vector<ContactPair>& out) const;
  bool Joined(int a, int b) const;

  std::vector<Face> faces_;
  std::vector<std::array<int, 2>> edges_;
  std::vector<int> neighbor_first_, neighbor_;
};

// Shortens the moves from `from` to `to` where needed so that no two elements of the cloth pass through each
// other on the way: every pair must stay apart along its own normal, and elements that are no pair must stay
// within half of `reach_mm`, at which the pairs were found at `from`. What all have in common, the rigid
// motion `carry`, is free. If `from` is free of intersections, so is the result. Returns the number of
// vertices that were held back. (The planes that divide two elements: Divide and Truncate, as in offset
// geometric contact, Chen et al. 2025.)
int KeepApart(const std::vector<ContactPair>& pairs, const std::vector<Eigen::Vector3d>& from_mm,
              const Eigen::Isometry3d& carry, double reach_mm, double thickness_mm,
              std::vector<Eigen::Vector3d>& to_mm);

}  // namespace weft
