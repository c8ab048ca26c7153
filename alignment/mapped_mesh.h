// What the board says of the faces of a mesh, by the map of its vertices.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/print_scale.h"
#include "alignment/template.h"

namespace weft {

// A garment's own faces; vertices are numbered as in the whole template.
struct GarmentFaces {
  std::string id;  // empty for a template of one garment
  std::span<const Face> faces;
};
std::vector<GarmentFaces> GarmentsOf(const Template& garment);
// With the garment's name in front.
absl::Status OfGarment(const std::string& id, const absl::Status& status);

// "vertex 3 is cell (1, 2)"
std::string VertexText(int v, const std::vector<VertexNode>& nodes);

// For errors of maps whose cells are those of other vertices.
inline constexpr char kOrderRemedy[] =
    " Programs that read and write meshes often renumber vertices: give the mesh and the map that were made "
    "together, or make the map anew from this mesh";

// A mesh, a map and how finely it divides the cloth.
struct Mapped {
  const std::vector<Eigen::Vector3d>& vertices_mm;
  const std::vector<VertexNode>& nodes;
  double mm_per_cell = 0;

  const VertexNode& NodeOf(int v) const { return nodes[static_cast<size_t>(v)]; }
  const Eigen::Vector3d& PlaceOf(int v) const { return vertices_mm[static_cast<size_t>(v)]; }
  // Of two vertices that are nodes.
  bool Apart(int a, int b) const {
    return IsApart({PlaceOf(b) - PlaceOf(a), NodeOf(b).PlaceInCells() - NodeOf(a).PlaceInCells()},
                   mm_per_cell);
  }
};

// What the board says of a face.
struct FaceOnBoard {
  int edges = 0;          // between nodes
  int apart = 0;          // of them, between nodes that are apart
  bool is_apart[3] = {};  // by edge: corners 0 and 1, 1 and 2, 2 and 0
  int sense = 0;          // 1: runs as seen from the printed side, -1: against it, 0: not to be told
};
FaceOnBoard OnBoard(const Face& face, const Mapped& mapped);

// With the fineness of the mesh that these faces have.
Mapped MappedOf(const std::vector<Eigen::Vector3d>& vertices_mm, std::span<const Face> faces,
                const std::vector<VertexNode>& nodes);

}  // namespace weft
