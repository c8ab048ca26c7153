// A piece of a mesh around places where it passes through itself, small enough to work on by itself.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// Faces around each vertex: entries [first[v], first[v + 1]) of `face`.
struct FacesOfVertex {
  FacesOfVertex(int vertices, const std::vector<Face>& faces);

  int vertices() const { return static_cast<int>(first.size()) - 1; }
  std::span<const int> of(int v) const { return {face.data() + first[v], face.data() + first[v + 1]}; }

  std::vector<int> first, face;
};

struct PatchEdge {
  int a = 0, b = 0;  // a < b
  int face[2] = {-1, -1};
};

// Numbered by itself: the vertices that may move first, then those that stay.
struct UntanglePatch {
  std::vector<int> vertex;  // [n], in the mesh; ascending among the free and the fixed
  int free = 0;
  std::vector<Eigen::Vector3d> observed_mm;  // [n], where the mesh has them
  std::vector<Eigen::Vector3d> position_mm;  // [n]
  std::vector<double> weight;                // [n], how firmly each is held where the mesh has it
  std::vector<double> bound_mm;  // [n], how far measured vertices may be from there; infinite for others
  std::vector<bool> released;    // [n], measured vertices that may be anywhere
  std::vector<Face> faces;
  std::vector<PatchEdge> edges;
  std::vector<std::array<int, 3>> edges_of_face;  // edge i joins the corners i and i + 1
  std::vector<int> neighbor_first, neighbor;      // of the free vertices, [free + 1] and their entries
  std::vector<int> face_first, face_of;           // faces around each vertex, [n + 1] and their entries

  bool IsMeasured(int v) const { return std::isfinite(bound_mm[v]); }
  bool IsBounded(int v) const { return IsMeasured(v) && !released[v]; }
  double MostWayMm(int v) const {
    return released[v] ? std::numeric_limits<double>::infinity() : bound_mm[v];
  }
  std::span<const int> NeighborsOf(int v) const {
    return {neighbor.data() + neighbor_first[v], neighbor.data() + neighbor_first[v + 1]};
  }
  std::span<const int> FacesOf(int v) const {
    return {face_of.data() + face_first[v], face_of.data() + face_first[v + 1]};
  }
};

// The groups of vertices grown by some rings of edges; those that meet become one. Each ordered, and ordered
// by their first vertex.
std::vector<std::vector<int>> GrowGroups(const std::vector<Face>& faces, const FacesOfVertex& around,
                                         const std::vector<std::vector<int>>& groups, int rings);

// The patch where the vertices `free` (ordered) may move, none released. Faces within about reach_mm of them
// belong to it, fixed. `sigma_mm` and `bound_mm` (infinite where nothing is measured): [vertices] or empty.
UntanglePatch CutPatch(const std::vector<Eigen::Vector3d>& observed_mm,
                       const std::vector<Eigen::Vector3d>& position_mm, const std::vector<Face>& faces,
                       std::span<const float> sigma_mm, std::span<const double> bound_mm,
                       const std::vector<int>& free, double reach_mm);

}  // namespace weft
