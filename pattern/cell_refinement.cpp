#include "pattern/cell_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace weft {
namespace {

// Cells by their place on the board.
class CellMap {
 public:
  CellMap(const Board& board, const std::vector<GrownCell>& cells)
      : board_(board), index_(board.cells.size(), -1) {
    for (size_t k = 0; k < cells.size(); ++k) {
      index_[static_cast<size_t>(cells[k].row) * board.cols + cells[k].col] = static_cast<int>(k);
    }
  }

  // Index of the cell, -1 where there is none.
  int At(int row, int col) const {
    return board_.Contains(row, col) ? index_[static_cast<size_t>(row) * board_.cols + col] : -1;
  }

 private:
  const Board& board_;
  std::vector<int> index_;
};

// The 3x3 cells around one, row by row; null where unknown.
using Surroundings = std::array<const CellFrame*, 9>;

Surroundings Around(const CellMap& map, const std::vector<CellFrame>& frames, int row, int col) {
  Surroundings near;
  for (int k = 0; k < 9; ++k) {
    const int other = map.At(row + k / 3 - 1, col + k % 3 - 1);
    near[k] = other >= 0 ? &frames[other] : nullptr;
  }
  return near;
}

// Second differences of the positions around a cell; axes without neighbours on both sides stay straight.
CellCurvature Curvature(const Surroundings& near) {
  CellCurvature k;
  const CellFrame& here = *near[4];
  if (near[3] && near[5]) {
    k.uu_x = near[3]->x + near[5]->x - 2 * here.x;
    k.uu_y = near[3]->y + near[5]->y - 2 * here.y;
  }
  if (near[1] && near[7]) {
    k.vv_x = near[1]->x + near[7]->x - 2 * here.x;
    k.vv_y = near[1]->y + near[7]->y - 2 * here.y;
  }
  if (near[0] && near[2] && near[6] && near[8]) {
    k.uv_x = 0.25f * (near[0]->x + near[8]->x - near[2]->x - near[6]->x);
    k.uv_y = 0.25f * (near[0]->y + near[8]->y - near[2]->y - near[6]->y);
  }
  return k;
}

// Distance in cells between a cell and where its neighbours expect it; a neighbour expects it half way
// between what its own edges say and what the cell's edges say.
float Misfit(const Surroundings& near) {
  const CellFrame& here = *near[4];
  float x = 0, y = 0, weights = 0;
  for (int k = 0; k < 9; ++k) {
    if (k == 4 || !near[k]) continue;
    const float dc = static_cast<float>(k % 3 - 1), dr = static_cast<float>(k / 3 - 1);
    const CellFrame& f = *near[k];
    const float weight = dc != 0 && dr != 0 ? 0.5f : 1.0f;
    x += weight * (f.x - 0.5f * (dc * (f.ax + here.ax) + dr * (f.bx + here.bx)) - here.x);
    y += weight * (f.y - 0.5f * (dc * (f.ay + here.ay) + dr * (f.by + here.by)) - here.y);
    weights += weight;
  }
  if (weights == 0) return 0;
  x /= weights;
  y /= weights;
  const float area = here.Area();
  return std::hypot(here.by * x - here.bx * y, here.ax * y - here.ay * x) / area;
}

std::vector<CellFrame> Frames(const std::vector<GrownCell>& cells) {
  std::vector<CellFrame> frames;
  frames.reserve(cells.size());
  for (const GrownCell& cell : cells) frames.push_back(cell.fit.frame);
  return frames;
}

void PlaceAgain(const CellFitter& fitter, const Board& board, const CellRefinementOptions& options,
                std::vector<GrownCell>* cells) {
  const CellMap map(board, *cells);
  const std::vector<CellFrame> before = Frames(*cells);
  for (GrownCell& cell : *cells) {
    const Surroundings near = Around(map, before, cell.row, cell.col);
    NeighborWeights weights;
    for (int k = 0; k < 9; ++k) weights[k] = near[k] ? 1.0f : 0.2f;
    const CellFit fit = fitter.Fit(cell.row, cell.col, cell.fit.frame, weights,
                                   {2, StrideFor(cell.fit.frame), options.reach, Curvature(near)});
    if (fit.converged && fit.moved_cells < options.max_move_cells) cell.fit = fit;
  }
}

// Probability that a cell is where it was found: a logistic model of how well the print explains its
// surroundings and its neighbours', how many neighbours are known, and how clearly its ink leads the others.
// The weights were fitted to ray-traced views with known truth.
float Confidence(const CellMap& map, const std::vector<GrownCell>& cells, const GrownCell& cell) {
  float neighbors = 0, explained_around = 0;
  for (int k = 0; k < 9; ++k) {
    const int other = k == 4 ? -1 : map.At(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
    if (other < 0) continue;
    neighbors += 1;
    explained_around += cells[other].fit.explained;
  }
  if (neighbors == 0) return 0;
  const float explained = std::clamp(cell.fit.explained, 0.0f, 1.0f);
  const float around = std::clamp(explained_around / neighbors, 0.0f, 1.0f);
  const float contrast2 = std::max(cell.fit.center_contrast * cell.fit.center_contrast, 1e-6f);
  const float lead = std::clamp(cell.fit.ink_lead / contrast2, 0.0f, 1.0f);
  const float logit = -6.2f + 3.4f * explained + 3.6f * around + 2.0f * lead + 6.0f * neighbors / 8;
  return 1 / (1 + std::exp(-logit));
}

template <typename Keep>
void Filter(Keep keep, std::vector<GrownCell>* cells) {
  size_t kept = 0;
  for (size_t k = 0; k < cells->size(); ++k) {
    if (keep(k)) (*cells)[kept++] = (*cells)[k];
  }
  cells->resize(kept);
}

// Size of the 4-connected component of each cell.
std::vector<int> ComponentSizes(const Board& board, const std::vector<GrownCell>& cells) {
  const CellMap map(board, cells);
  std::vector<int> size(cells.size(), 0);
  std::vector<int> members;
  for (size_t seed = 0; seed < cells.size(); ++seed) {
    if (size[seed] > 0) continue;
    members.assign(1, static_cast<int>(seed));
    size[seed] = 1;
    for (size_t k = 0; k < members.size(); ++k) {
      const GrownCell& cell = cells[members[k]];
      for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
        const int next = map.At(cell.row + dr, cell.col + dc);
        if (next < 0 || size[next] > 0) continue;
        size[next] = 1;
        members.push_back(next);
      }
    }
    for (const int k : members) size[k] = static_cast<int>(members.size());
  }
  return size;
}

}  // namespace

absl::Status CellRefinementOptions::Validate() const {
  if (!(reach >= 0.5f && reach <= 1.5f))
    return absl::InvalidArgumentError("refinement.reach must lie in 0.5 to 1.5");
  if (!(max_move_cells > 0)) return absl::InvalidArgumentError("refinement.max_move_cells must be above 0");
  if (!(max_misfit_cells > 0))
    return absl::InvalidArgumentError("refinement.max_misfit_cells must be above 0");
  if (!(min_confidence >= 0 && min_confidence < 1)) {
    return absl::InvalidArgumentError("refinement.min_confidence must lie in [0, 1)");
  }
  if (min_component < 1) return absl::InvalidArgumentError("refinement.min_component must be at least 1");
  return absl::OkStatus();
}

void RefineCells(const CellFitter& fitter, const Board& board, const CellRefinementOptions& options,
                 std::vector<GrownCell>* cells) {
  PlaceAgain(fitter, board, options, cells);
  {
    const CellMap map(board, *cells);
    const std::vector<CellFrame> frames = Frames(*cells);
    Filter(
        [&](size_t k) {
          return Misfit(Around(map, frames, (*cells)[k].row, (*cells)[k].col)) <= options.max_misfit_cells;
        },
        cells);
  }
  {
    const CellMap map(board, *cells);
    for (GrownCell& cell : *cells) cell.confidence = Confidence(map, *cells, cell);
    Filter([&](size_t k) { return (*cells)[k].confidence >= options.min_confidence; }, cells);
  }
  const std::vector<int> sizes = ComponentSizes(board, *cells);
  Filter([&](size_t k) { return sizes[k] >= options.min_component; }, cells);
}

}  // namespace weft
