// A garment's mesh: what any cloth has, whether or not a board was printed on it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"

namespace weft {

// Texture coordinates: u to the right and v upwards, 0 to 1. A vertex on a seam has one place on each panel,
// so faces may need coordinates of their own.
struct MeshTexture {
  std::vector<Eigen::Vector2f> of_vertex;                 // [vertices]; empty: no texture
  std::vector<std::array<Eigen::Vector2f, 3>> of_corner;  // [faces]; empty where of_vertex serves all faces

  bool empty() const { return of_vertex.empty(); }
  // Of corner k of a face. The texture must not be empty.
  const Eigen::Vector2f& At(const std::vector<Face>& faces, size_t face, size_t k) const {
    return of_corner.empty() ? of_vertex[static_cast<size_t>(faces[face][k])] : of_corner[face][k];
  }
};

// One of several garments in one mesh: vertices and faces that follow each other.
struct GarmentSpan {
  std::string id;
  int first_vertex = 0, vertices = 0;
  int first_face = 0, faces = 0;

  auto operator<=>(const GarmentSpan&) const = default;
};

// Lengths at rest are those of the edges of `rest`. Whatever takes a GarmentMesh works on cloth that nothing
// was printed on; a Template (template.h) is one whose vertices are nodes of a board.
struct GarmentMesh {
  std::string id;
  TriangleMesh rest;
  MeshTexture texture;                // its charts (texture_charts.h); empty: none are known
  std::vector<GarmentSpan> garments;  // from the innermost to the outermost; empty: one garment

  // 16 hex digits over the vertices and faces at rest. Not the hash of a template, which has a board as well.
  std::string MeshHash() const;
};

// InvalidArgument names the first face or vertex that is not cloth: no vertices or faces, positions that are
// not finite, a face that names no vertex or one twice, an edge with more than two faces.
absl::Status CheckGarmentMesh(const TriangleMesh& mesh);

// Garments follow each other, and their faces join vertices of their own; names differ. InvalidArgument names
// the first that does not fit. A mesh without any passes.
absl::Status CheckGarmentSpans(const GarmentMesh& garment);

}  // namespace weft
