#include "pattern/cell_mesh.h"

#include <array>
#include <cmath>

#include "pattern/cell_map.h"

namespace weft {
namespace {

// Weight of what may be hidden.
constexpr float kUnknownWeight = 0.2f;
// Cells hide mostly where cloth turns away from the camera: the edge to a hidden cell is shorter.
constexpr float kHiddenEdge = 0.93f;
// Differences along a row or column of centres at which the prior lets go, in cells.
constexpr float kFourthDifference = 0.1f, kSecondDifference = 0.03f;

// Positions along a row or column of the board, two cells to both sides; null where unknown.
using Line = std::array<const CellFrame*, 5>;

// Least squares of the centre of a line by its differences, each with the weight of a Cauchy distribution.
class PriorSums {
 public:
  explicit PriorSums(float area_px2) : area_px2_(area_px2) {}

  void Add(const Line& line) {
    const auto [before2, before, here, after, after2] = line;
    if (before2 && before && after && after2) {
      AddDifference({1, -4, 6, -4, 1}, line, 6, kFourthDifference);
      return;
    }
    if (before && after) AddDifference({0, 1, -2, 1, 0}, line, -2, kSecondDifference);
    if (after && after2) AddDifference({0, 0, 1, -2, 1}, line, 1, kSecondDifference);
    if (before && before2) AddDifference({1, -2, 1, 0, 0}, line, 1, kSecondDifference);
  }

  CenterPrior Solve(const CellFrame& here) const {
    if (!(precision_ > 0)) return {};
    return {here.x - x_ / precision_, here.y - y_ / precision_, precision_};
  }

 private:
  void AddDifference(const std::array<float, 5>& weights, const Line& line, float own, float scale_cells) {
    float x = 0, y = 0;
    for (int k = 0; k < 5; ++k) {
      if (weights[k] == 0) continue;
      x += weights[k] * line[k]->x;
      y += weights[k] * line[k]->y;
    }
    const float precision = 1 / (scale_cells * scale_cells * area_px2_ + x * x + y * y);
    precision_ += precision * own * own;
    x_ += precision * own * x;
    y_ += precision * own * y;
  }

  float area_px2_;
  float precision_ = 0, x_ = 0, y_ = 0;
};

class MeshSweep {
 public:
  MeshSweep(const Board& board, GrownCells* cells) : board_(board), cells_(*cells), map_(board, *cells) {}

  void Run(const CellFitter& fitter, float least_move_cells, const std::vector<bool>& stays) {
    for (size_t k = 0; k < cells_.size(); ++k) {
      GrownCell& cell = cells_[k];
      if (stays[k] || cell.fit.moved_cells < least_move_cells) continue;
      NeighborWeights weights;
      const CellNodes nodes = NodesAround(cell, &weights);
      CellFit fit = fitter.FitCenter(cell.row, cell.col, nodes, weights, PriorOf(cell));
      if (!fit.converged) continue;
      CellFrame frame = cell.fit.frame;
      frame.x = fit.frame.x;
      frame.y = fit.frame.y;
      cell.fit = fit;
      cell.fit.frame = frame;
    }
  }

 private:
  const CellFrame* At(int row, int col) const {
    const int k = map_.At(row, col);
    return k < 0 ? nullptr : &cells_[k].fit.frame;
  }

  // Unknown neighbours are about where the cell's own edges put them.
  CellNodes NodesAround(const GrownCell& cell, NeighborWeights* weights) const {
    CellNodes nodes;
    std::array<const CellFrame*, 9> near;
    const CellFrame& f = cell.fit.frame;
    for (int k = 0; k < 9; ++k) {
      const int row = cell.row + k / 3 - 1, col = cell.col + k % 3 - 1;
      near[k] = At(row, col);
      (*weights)[k] = near[k] ? 1 : kUnknownWeight;
      const float dc = static_cast<float>(k % 3 - 1), dr = static_cast<float>(k / 3 - 1);
      const float edge = board_.Contains(row, col) ? kHiddenEdge : 1;
      nodes.x[k] = near[k] ? near[k]->x : f.x + edge * (dc * f.ax + dr * f.bx);
      nodes.y[k] = near[k] ? near[k]->y : f.y + edge * (dc * f.ay + dr * f.by);
    }
    for (const int k : {0, 2, 6, 8}) {
      if (near[k]) continue;
      const int in_column = k < 3 ? 1 : 7, in_row = k % 3 == 0 ? 3 : 5;
      nodes.x[k] = nodes.x[in_column] + nodes.x[in_row] - f.x;
      nodes.y[k] = nodes.y[in_column] + nodes.y[in_row] - f.y;
    }
    return nodes;
  }

  CenterPrior PriorOf(const GrownCell& cell) const {
    PriorSums sums(std::abs(cell.fit.frame.Area()));
    for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}}) {
      Line line;
      for (int k = -2; k <= 2; ++k) line[k + 2] = At(cell.row + k * dr, cell.col + k * dc);
      sums.Add(line);
    }
    return sums.Solve(cell.fit.frame);
  }

  const Board& board_;
  GrownCells& cells_;
  CellMap map_;
};

}  // namespace

void SweepCenters(const CellFitter& fitter, const Board& board, float least_move_cells,
                  const std::vector<bool>& stays, GrownCells* cells) {
  MeshSweep(board, cells).Run(fitter, least_move_cells, stays);
}

}  // namespace weft
