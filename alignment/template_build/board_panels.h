// Which cells of the board are in the garment, and in which of its panels.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template_build/cell_grid.h"

namespace weft {

struct PanelOptions {
  int min_panel_cells = 60;     // smaller pieces are specks
  double max_hole_mm2 = 10000;  // unseen places inside a panel up to this size belong to it
  int closing_cells = 2;        // notches of the outline up to twice as wide are unseen cells
  // Cells side by side on the board that are further apart in space than this many pitches were cut apart.
  double cut_pitches = 1.6;

  absl::Status Validate() const;
};

struct BoardPanels {
  int rows = 0;
  int cols = 0;
  int panels = 0;
  std::vector<int> panel_of_cell;  // [rows][cols], -1 for cells that are not in the garment

  int filled_cells = 0;  // in a panel though no cloud has them
  int speck_cells = 0;   // seen, but in pieces too small for a panel

  int At(int row, int col) const {
    return row < 0 || col < 0 || row >= rows || col >= cols ? -1 : panel_of_cell[row * cols + col];
  }
};

// Panels from clouds: the union of the observed cells, split where panels abut on the board but are apart
// in space. Small holes and notches are filled, specks removed. Panels are numbered by their first cell,
// row by row. FailedPrecondition when nothing is left.
absl::StatusOr<BoardPanels> FindPanels(const std::vector<CellGrid>& grids, double cell_mm,
                                       const PanelOptions& options);

// Panels from a label image of the board ([rows][cols], 0 for cells outside the garment). Disconnected
// pieces of one label are separate panels; specks are removed. FailedPrecondition when nothing is left.
absl::StatusOr<BoardPanels> PanelsFromLabels(const std::vector<uint8_t>& labels,
                                             const std::vector<CellGrid>& grids, double cell_mm,
                                             const PanelOptions& options);

}  // namespace weft
