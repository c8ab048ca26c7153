// What is known of a garment beyond its mesh and cells: panels, seams, openings, texture.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"

namespace weft {

// Cells of the board that hang together.
struct TemplatePanel {
  int cells = 0;
  int first_row = 0, last_row = 0, first_col = 0, last_col = 0;
  // In the texture, in cells from its upper left corner: where the panel's box begins that holds its first
  // row and column, after that many quarter turns clockwise.
  int texture_row = 0, texture_col = 0, quarter_turns = 0;
};

// Two runs of border points that face each other, and the row of vertices between them, which have no cell.
// Neither side leaves out a vertex.
struct Seam {
  std::vector<int> side_a;  // vertices, along the loop
  std::vector<int> side_b;  // vertices, against the loop; side_b.front() faces side_a.front()
  int panel_a = -1, panel_b = -1;
  double length_mm = 0;  // mean of both sides, on the board
  double gap_mm = 0;     // median distance of the sides
  double max_gap_mm = 0;
  bool wide = false;        // beyond the greatest gap, but between two seams
  std::vector<int> middle;  // vertices, along side_a
};

// A border of the sewn mesh.
struct TemplateBorder {
  std::vector<int> loop;    // vertices, the cloth to the left seen from outside
  double length_mm = 0;     // at rest
  std::vector<int> panels;  // that it runs along
};

// Of a template that was imported: no more than what its maker said and the size of the board.
struct GarmentParts {
  double cell_mm = 0;
  std::vector<TemplatePanel> panels;
  std::vector<Seam> seams;
  std::vector<TemplateBorder> openings;  // longest first
  int expected_openings = -1;            // as its maker said; -1: not said
  int panel_faces = 0;                   // the first faces lie in panels; the others close seams and holes
  // The panels as they lie on the board, packed into a square. Distances within a panel are those of the
  // print. Faces that close seams reach from one panel to another and have no texture. Vertices between
  // panels have the coordinates of a vertex beside them.
  double texture_side_mm = 0;
  std::vector<Eigen::Vector2d> texture_mm;  // [vertices], from the lower left corner; empty: no texture
  int board_rows = 0, board_cols = 0;       // of the board that it was sewn from; 0: not known
  bool any_scale = false;  // its maker took a mesh of another size than the print (template_check.h)
};

// InvalidArgument names the first entry that does not fit a mesh: unknown vertices or panels, a texture of
// another length or outside its square.
absl::Status CheckGarmentParts(const GarmentParts& parts, const TriangleMesh& mesh);

}  // namespace weft
