// The mesh of one panel on the board: cells inside its outline, and a strip of triangles out to the outline.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/template.h"
#include "simulation/printed_mesh.h"

namespace weft {

// Nodes 0 .. outline - 1 are the outline's points, the others the centres of `cells`.
struct PanelMesh {
  std::vector<VertexNode> cells;
  std::vector<Face> faces;  // clockwise on the board (y down: counter-clockwise seen from outside)

  BoardPoint NodeAt(const std::vector<BoardPoint>& outline, int node) const;
};

// `outline`: a simple closed polygon on the board, points about a cell apart, either sense. Two triangles
// between four neighbouring centres, diagonals alternating; the strip between the centres and the outline is
// the triangulation of best total shape. InvalidArgument when the outline is too small or too narrow
// somewhere for that.
absl::StatusOr<PanelMesh> MeshPanel(const std::vector<BoardPoint>& outline);

}  // namespace weft
