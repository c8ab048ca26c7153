// A cloud laid out on the board.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "triangulation/cloud.h"

namespace weft {

// The centres of a cloud by board cell.
struct CellGrid {
  int rows = 0;
  int cols = 0;
  std::vector<Eigen::Vector3d> position_mm;  // [rows][cols]
  std::vector<bool> seen;                    // [rows][cols]

  int Index(int row, int col) const { return row * cols + col; }
  int SeenCells() const;
};

// InvalidArgument names the first cell that is not on the board.
absl::StatusOr<CellGrid> GridFromCloud(const Cloud& cloud, int rows, int cols);

// Median distance of cells that are seen and lie side by side; 0 without such cells.
double MeasuredPitchMm(const CellGrid& grid);

// Forgets points that cloth cannot explain: it bends but hardly stretches, so cells up to two apart on the
// board cannot be much further apart in space. A point needs two cells around it that agree. Returns how many
// were forgotten.
int ForgetContradictions(double cell_mm, CellGrid* grid);

}  // namespace weft
