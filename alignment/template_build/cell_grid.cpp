#include "alignment/template_build/cell_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"

namespace weft {
namespace {

constexpr double kMostStretch = 1.4;  // of the distance on the board, noise included
constexpr int kReach = 2;             // cells
constexpr int kWitnesses = 2;

bool Agrees(const CellGrid& grid, double cell_mm, int row, int col, int other_row, int other_col) {
  if (other_row < 0 || other_col < 0 || other_row >= grid.rows || other_col >= grid.cols) return false;
  const int other = grid.Index(other_row, other_col);
  if (!grid.seen[other]) return false;
  const double board_mm = cell_mm * std::hypot(other_row - row, other_col - col);
  return (grid.position_mm[other] - grid.position_mm[grid.Index(row, col)]).norm() <= kMostStretch * board_mm;
}

bool Confirmed(const CellGrid& grid, double cell_mm, int row, int col) {
  int witnesses = 0;
  for (int r = row - kReach; r <= row + kReach; ++r) {
    for (int c = col - kReach; c <= col + kReach; ++c) {
      if (r == row && c == col) continue;
      if (Agrees(grid, cell_mm, row, col, r, c) && ++witnesses == kWitnesses) return true;
    }
  }
  return false;
}

}  // namespace

int CellGrid::SeenCells() const { return static_cast<int>(std::count(seen.begin(), seen.end(), true)); }

absl::StatusOr<CellGrid> GridFromCloud(const Cloud& cloud, int rows, int cols) {
  const size_t cells = static_cast<size_t>(rows) * cols;
  CellGrid grid{rows, cols, std::vector<Eigen::Vector3d>(cells, Eigen::Vector3d::Zero()),
                std::vector<bool>(cells, false)};
  for (const CloudPoint& point : cloud.points) {
    if (point.node.kind != NodeKind::kCenter) continue;
    const auto [row, col, kind] = point.node;
    if (row < 0 || col < 0 || row >= rows || col >= cols) {
      return absl::InvalidArgumentError(absl::StrCat("cell (", row, ", ", col, ") is not on the board of ",
                                                     rows, " rows and ", cols,
                                                     " columns; is this the board that the garment was sewn "
                                                     "from?"));
    }
    grid.position_mm[grid.Index(row, col)] = point.position_mm;
    grid.seen[grid.Index(row, col)] = true;
  }
  return grid;
}

double MeasuredPitchMm(const CellGrid& grid) {
  std::vector<double> pitch_mm;
  const auto add = [&](int a, int b) {
    if (grid.seen[a] && grid.seen[b]) pitch_mm.push_back((grid.position_mm[a] - grid.position_mm[b]).norm());
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (col + 1 < grid.cols) add(grid.Index(row, col), grid.Index(row, col + 1));
      if (row + 1 < grid.rows) add(grid.Index(row, col), grid.Index(row + 1, col));
    }
  }
  return Median(std::move(pitch_mm));
}

int ForgetContradictions(double cell_mm, CellGrid* grid) {
  std::vector<int> contradicted;
  for (int row = 0; row < grid->rows; ++row) {
    for (int col = 0; col < grid->cols; ++col) {
      const int cell = grid->Index(row, col);
      if (grid->seen[cell] && !Confirmed(*grid, cell_mm, row, col)) contradicted.push_back(cell);
    }
  }
  for (const int cell : contradicted) grid->seen[cell] = false;
  return static_cast<int>(contradicted.size());
}

}  // namespace weft
