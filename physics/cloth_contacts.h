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

// Finds the pairs step by step. Candidates from a grid are kept as long as nothing has moved far.
class ContactFinder {
 public:
  // `reach_mm`: pairs nearer than that are found.
  ContactFinder(int vertices, const std::vector<Face>& faces, double reach_mm);

  // All pairs within reach, in an order that follows from the calls before. `carry`: the rigid motion since
  // the last call that all vertices have about in common. Parallel in the calling thread's TBB arena, the
  // same result at any thread count.
  const std::vector<ContactPair>& Find(const std::vector<Eigen::Vector3d>& x_mm,
                                       const Eigen::Isometry3d& carry);

  // What later calls depend on (state_archive.h).
  template <typename Archive>
  void State(Archive& archive) {
    archive(at_faces_), archive(at_edges_), archive(listed_at_mm_), archive(moved_mm_);
  }

 private:
  struct Candidate {
    int a, b;           // vertex and face, or two edges
    float distance_mm;  // when it was listed
  };

  void ListVerticesAtFaces(const std::vector<Eigen::Vector3d>& x_mm, double reach_mm);
  void ListEdgesAtEdges(const std::vector<Eigen::Vector3d>& x_mm, double reach_mm);
  void Measure(const std::vector<Eigen::Vector3d>& x_mm);
  bool Joined(int a, int b) const;

  std::vector<Face> faces_;
  std::vector<std::array<int, 2>> edges_;
  std::vector<int> neighbor_first_, neighbor_;
  double reach_mm_, margin_mm_;
  std::vector<Candidate> at_faces_, at_edges_;
  std::vector<Eigen::Vector3d> listed_at_mm_;  // positions when the candidates were listed, carried since
  std::vector<float> moved_mm_;                // how far each vertex is from there
  std::vector<ContactPair> pairs_;
};

struct KeptApart {
  int held_back = 0;       // vertices whose displacement was shortened
  std::vector<int> stuck;  // those among them that only move with others, or not against `carry`, ascending
};

struct KeepApartOptions {
  double reach_mm = 0;      // at which the pairs were found
  double thickness_mm = 0;  // of a layer
  // Whether planes between two elements may turn with them. Otherwise long elements that a body presses
  // together are held fast while it turns; nothing else brings them that near. Held elements stand still
  // then.
  bool planes_turn = true;
};

// Shortens the displacements from `from` to `to` where needed so that no two elements of the cloth
// intersect on the way. Every pair must stay separated by a plane along its own normal, or by planes that
// turn. Other elements must stay within half of the reach. The common rigid motion `carry` is not limited.
// Where planes turn, elements that no shorter way of their own keeps apart move as one (impact_zones.h): were
// they held still, cloth that moves on around them would be torn off and be held as well.
// If `from` is free of intersections, so is the result. (The planes that divide two elements: Divide and
// Truncate, as in offset geometric contact, Chen et al. 2025.)
KeptApart KeepApart(const std::vector<ContactPair>& pairs, const std::vector<Eigen::Vector3d>& from_mm,
                    const Eigen::Isometry3d& carry, const KeepApartOptions& options,
                    std::vector<Eigen::Vector3d>& to_mm);

}  // namespace weft
