#include "pattern/cell_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace weft {
namespace {

constexpr float kLargestShift = 0.25f;  // cells

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

// Positions along one axis of the board, three cells to both sides; null where unknown.
using Line = std::array<const CellFrame*, 7>;

Line LineThrough(const CellMap& map, const std::vector<CellFrame>& frames, int row, int col, int dr, int dc) {
  Line line;
  for (int k = -3; k <= 3; ++k) {
    const int other = map.At(row + k * dr, col + k * dc);
    line[k + 3] = other >= 0 ? &frames[other] : nullptr;
  }
  return line;
}

// What the differences along a line of cells say about the error of the middle one. A fit averages over the
// cell, so the middle is off towards the chord of bent cloth: by kBend of the second difference. And what
// is rough between neighbours is noise: part of the third or fourth difference. The shares were fitted to
// ray-traced views with known truth.
struct Shift {
  float x = 0, y = 0;
};
Shift ErrorAlong(const Line& line) {
  const auto known = [&](int from, int to) {
    return std::all_of(line.begin() + 3 + from, line.begin() + 4 + to, [](const CellFrame* f) { return f; });
  };
  // Weights of the cells -3 to 3.
  static constexpr std::array<float, 7> kFive = {0, 0.065f, -0.095f, 0.06f, -0.095f, 0.065f, 0};
  static constexpr std::array<float, 7> kFour = {0, 0, 0.05f, -0.04f, -0.07f, 0.06f, 0};
  static constexpr std::array<float, 7> kThree = {0, 0, 0.05f, -0.1f, 0.05f, 0, 0};
  static constexpr std::array<float, 7> kOneSided = {0, 0, 0, 0.08f, -0.18f, 0.12f, -0.02f};
  const std::array<float, 7>* weights = nullptr;
  bool mirrored = false;
  if (known(-2, 2)) {
    weights = &kFive;
  } else if (known(-1, 1)) {
    mirrored = known(-2, 1);
    weights = mirrored || known(-1, 2) ? &kFour : &kThree;
  } else if (known(0, 3) || known(-3, 0)) {
    mirrored = !known(0, 3);
    weights = &kOneSided;
  }
  Shift error;
  if (weights == nullptr) return error;
  for (int k = -3; k <= 3; ++k) {
    const float weight = (*weights)[3 + k];
    if (weight == 0) continue;
    const CellFrame& f = *line[mirrored ? 3 - k : 3 + k];
    error.x += weight * f.x;
    error.y += weight * f.y;
  }
  return error;
}

void Sharpen(const Board& board, std::vector<GrownCell>* cells) {
  const CellMap map(board, *cells);
  const std::vector<CellFrame> before = Frames(*cells);
  for (size_t k = 0; k < cells->size(); ++k) {
    GrownCell& cell = (*cells)[k];
    const Shift u = ErrorAlong(LineThrough(map, before, cell.row, cell.col, 0, 1));
    const Shift v = ErrorAlong(LineThrough(map, before, cell.row, cell.col, 1, 0));
    // Larger ones are no noise: a neighbour is wrong.
    const float x = u.x + v.x, y = u.y + v.y, limit = kLargestShift * before[k].ShorterEdge();
    if (x * x + y * y > limit * limit) continue;
    cell.fit.frame.x -= x;
    cell.fit.frame.y -= y;
  }
}

// How clearly the ink leads the others, 0 to 1.
float RelativeLead(const CellFit& fit) {
  const float contrast2 = std::max(fit.center_contrast * fit.center_contrast, 1e-6f);
  return std::clamp(fit.ink_lead / contrast2, 0.0f, 1.0f);
}

// Probability that a cell is where it was found: a logistic model of how well the print explains its
// surroundings and its neighbours', how many neighbours are known and agree, and how clearly its ink leads
// the others. The weights were fitted to ray-traced views with known truth.
float Confidence(const CellMap& map, const std::vector<GrownCell>& cells, const GrownCell& cell,
                 float misfit_cells, int width_px, int height_px) {
  const CellFrame& f = cell.fit.frame;
  float neighbors = 0, explained_around = 0, light_around = 0, lead_around = 0, shape = 0;
  float present = 0, edge_present = 0;  // with those that the border of the image cuts off
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const int dr = k / 3 - 1, dc = k % 3 - 1;
    const int other = map.At(cell.row + dr, cell.col + dc);
    const float x = f.x + static_cast<float>(dc) * f.ax + static_cast<float>(dr) * f.bx,
                y = f.y + static_cast<float>(dc) * f.ay + static_cast<float>(dr) * f.by;
    const bool outside =
        x < 0 || y < 0 || x > static_cast<float>(width_px - 1) || y > static_cast<float>(height_px - 1);
    present += other >= 0 || outside;
    edge_present += (other >= 0 || outside) && k % 2 == 1;
    if (other < 0) continue;
    neighbors += 1;
    const CellFit& fit = cells[other].fit;
    explained_around += std::clamp(fit.explained, 0.0f, 1.0f);
    light_around += fit.gain;
    lead_around += RelativeLead(fit);
    const CellFrame& g = fit.frame;
    shape += (std::hypot(f.ax - g.ax, f.ay - g.ay) + std::hypot(f.bx - g.bx, f.by - g.by)) / f.ShorterEdge();
  }
  if (neighbors == 0) return 0;
  const float explained = std::clamp(cell.fit.explained, 0.0f, 1.0f);
  const float share = 1 / neighbors;
  const float light = std::min(std::abs(std::log(cell.fit.gain / (share * light_around))), 2.0f);
  const float logit = -6.82f + 2.89f * explained + 4.59f * share * explained_around +
                      1.09f * RelativeLead(cell.fit) + 2.36f * share * lead_around + 3.5f * present / 8 +
                      2.19f * edge_present / 4 - 0.79f * std::min(misfit_cells, 1.0f) - 2.36f * light -
                      2.39f * std::min(share * shape, 2.0f);
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
  if (!(min_confidence >= 0 && min_confidence < 1)) {
    return absl::InvalidArgumentError("refinement.min_confidence must lie in [0, 1)");
  }
  if (min_component < 1) return absl::InvalidArgumentError("refinement.min_component must be at least 1");
  return absl::OkStatus();
}

void RefineCells(const Board& board, int width_px, int height_px, const CellRefinementOptions& options,
                 std::vector<GrownCell>* cells) {
  {
    const CellMap map(board, *cells);
    const std::vector<CellFrame> frames = Frames(*cells);
    for (GrownCell& cell : *cells) {
      cell.confidence =
          Confidence(map, *cells, cell, Misfit(Around(map, frames, cell.row, cell.col)), width_px, height_px);
    }
    Filter([&](size_t k) { return (*cells)[k].confidence >= options.min_confidence; }, cells);
  }
  const std::vector<int> sizes = ComponentSizes(board, *cells);
  Filter([&](size_t k) { return sizes[k] >= options.min_component; }, cells);
  Sharpen(board, cells);
}

}  // namespace weft
