// The panels as flat meshes with a vertex on every cell.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/template.h"
#include "alignment/template_build/board_panels.h"

namespace weft {

// All panels, lying on the board as they were printed: x along the columns, y along the rows, z into the
// cloth, the print outside. Cell (r, c) lies at ((c + 1/2) cell_mm, (r + 1/2) cell_mm, 0).
struct PanelSheet {
  TriangleMesh flat;
  std::vector<VertexNode> cell_of_vertex;  // [vertices], every vertex has one
  std::vector<int> panel_of_vertex;        // [vertices], ascending
  int panels = 0;
  std::vector<std::vector<int>> loops;  // outlines and holes of the panels, as CheckTopology gives them
};

// Two triangles between four neighbouring cells of a panel, diagonals alternating; one where three of the
// four are there. Cells that hang on by less than a triangle, or at which pieces merely touch, are left out.
// FailedPrecondition when no panel of min_panel_cells is left.
absl::StatusOr<PanelSheet> MakePanelSheet(const BoardPanels& panels, double cell_mm, int min_panel_cells);

}  // namespace weft
