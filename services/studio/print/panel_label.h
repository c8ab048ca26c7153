// Where the number of a panel is printed, so that it stays with the cloth and harms no cell.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "services/studio/print/print_layout.h"

namespace weft {

struct PanelLabel {
  std::string text;
  double size_mm = 0;                                                                   // of the font
  Eigen::Vector2d low_mm = Eigen::Vector2d::Zero(), high_mm = Eigen::Vector2d::Zero();  // box on the page
  bool upright = false;                                                                 // read from below
  // Where it stands in the waste: the point of the panel's cut line that a line leads to.
  std::optional<Eigen::Vector2d> leader_mm;
};

// In the seam allowance, as large as its free cells allow. Where that is too narrow or missing, below the
// piece: over nothing but the gap that LayOutBoard leaves there. `cells` of PieceCells.
PanelLabel PlacePanelLabel(const PrintPiece& piece, const std::vector<uint8_t>& cells, double cell_mm);

}  // namespace weft
