// A garment's template: its mesh at rest and the board node of each vertex.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "alignment/mesh.h"
#include "pattern/board/board.h"
#include "pattern/observation.h"

namespace weft {

// What of the board a vertex is: the centre of a cell, a corner between cells (as BoardNode counts them), or
// nothing (seams): row and col are -1.
struct VertexNode {
  int row = -1;
  int col = -1;
  NodeKind kind = NodeKind::kCenter;

  bool IsCell() const { return row >= 0 && kind == NodeKind::kCenter; }
  bool IsCorner() const { return row >= 0 && kind == NodeKind::kCorner; }
  // Column and row on the board, in cells: the centre of cell (r, c) is at (c + 0.5, r + 0.5), corner (r, c)
  // at (c, r).
  Eigen::Vector2d PlaceInCells() const {
    const double middle = kind == NodeKind::kCenter ? 0.5 : 0;
    return {col + middle, row + middle};
  }
};

// The board that a garment was sewn from, and where on it each vertex lies: what only a printed board gives.
struct BoardMap {
  std::string board_hash;                  // Board::ContentHash
  std::vector<VertexNode> node_of_vertex;  // [vertices]
};

// A garment's mesh with its map of the board: what registration needs. Alignment and decoding read both;
// whatever takes a GarmentMesh does not depend on the board.
struct Template : GarmentMesh, BoardMap {
  // 16 hex digits over mesh, map and board hash.
  std::string ContentHash() const;
};

// Parses a map of cells, or of corners, with a line `row col` per vertex, `-1 -1` for none. InvalidArgument
// names source_name and line.
absl::StatusOr<std::vector<VertexNode>> ParseVertexMap(std::string_view text, NodeKind kind,
                                                       const std::string& source_name);

// Adds a map of corners to one of cells for the same vertices. InvalidArgument names the first vertex that is
// in both, or says that their lengths differ.
absl::Status JoinCorners(const std::vector<VertexNode>& corners, std::vector<VertexNode>* nodes);

// What ImportTemplate asks of the map of a mesh with that many vertices. InvalidArgument names the first
// vertex that does not fit; the map's line of vertex v is v + 1.
absl::Status CheckVertexNodes(const std::vector<VertexNode>& nodes, size_t vertices, const Board& board);

// Checks that mesh, map and board agree: one entry per vertex, nodes on the board and used once, at least
// one cell. Errors also of CheckGarmentMesh. InvalidArgument names the first vertex or face that does not
// fit.
absl::StatusOr<Template> ImportTemplate(std::string id, TriangleMesh mesh, std::vector<VertexNode> nodes,
                                        const Board& board);

}  // namespace weft
