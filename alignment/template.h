// A garment's template: its mesh at rest and the board cell of each vertex.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "pattern/board.h"

namespace weft {

// Board cell of a vertex; row and col are -1 for vertices without a cell (seams).
struct VertexCell {
  int row = -1;
  int col = -1;
};

struct Template {
  std::string id;
  std::string board_hash;  // Board::ContentHash of the board that the garment was sewn from
  TriangleMesh rest;
  std::vector<VertexCell> cell_of_vertex;  // [vertices]

  // 16 hex digits over mesh, map and board hash.
  std::string ContentHash() const;
};

// Parses a map with a line `row col` per vertex, `-1 -1` for none. InvalidArgument names source_name and
// line.
absl::StatusOr<std::vector<VertexCell>> ParseVertexCells(std::string_view text,
                                                         const std::string& source_name);

// What ImportTemplate asks of the mesh alone, and of the map for a mesh with that many vertices.
// InvalidArgument names the first face or vertex that does not fit; the map's line of vertex v is v + 1.
absl::Status CheckTemplateMesh(const TriangleMesh& mesh);
absl::Status CheckVertexCells(const std::vector<VertexCell>& cells, size_t vertices, const Board& board);

// Checks that mesh, map and board fit: one entry per vertex, cells on the board and claimed once, faces with
// valid and distinct indices, finite vertices, no edge with more than two faces. InvalidArgument names the
// first vertex or face that does not fit.
absl::StatusOr<Template> ImportTemplate(std::string id, TriangleMesh mesh, std::vector<VertexCell> cells,
                                        const Board& board);

}  // namespace weft
