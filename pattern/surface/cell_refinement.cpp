#include "pattern/surface/cell_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "pattern/surface/cell_map.h"
#include "pattern/surface/cell_mesh.h"

namespace weft {
namespace {

float Length(float x, float y) { return std::sqrt(x * x + y * y); }

// How clearly the ink leads the others, 0 to 1.
float RelativeLead(const CellFit& fit) {
  const float contrast2 = std::max(fit.center_contrast * fit.center_contrast, 1e-6f);
  return std::clamp(fit.ink_lead / contrast2, 0.0f, 1.0f);
}

// A cell that moved by less in the first sweep has settled.
constexpr float kSettledCells = 0.02f;

// What speaks for a cell and against it.
constexpr int kReasons = 11;
using Evidence = std::array<float, kReasons>;

// Sums over the cells around one.
struct Surroundings {
  float known = 0, explained = 0, light = 0, lead = 0, shape = 0;
  // Where they expect the cell, less where it is; each half way between what its own edges say and what the
  // cell's edges say. In px, with weights.
  float x = 0, y = 0, weights = 0;
  std::array<bool, 9> present = {};  // or cut off by the border of the image

  void Add(const CellFrame& here, const CellFit& near, float dr, float dc) {
    const CellFrame& f = near.frame;
    known += 1;
    explained += std::clamp(near.explained, 0.0f, 1.0f);
    light += near.gain;
    lead += RelativeLead(near);
    shape += (Length(here.ax - f.ax, here.ay - f.ay) + Length(here.bx - f.bx, here.by - f.by)) /
             here.ShorterEdge();
    const float weight = dc != 0 && dr != 0 ? 0.5f : 1.0f;
    x += weight * (f.x - 0.5f * (dc * (f.ax + here.ax) + dr * (f.bx + here.bx)) - here.x);
    y += weight * (f.y - 0.5f * (dc * (f.ay + here.ay) + dr * (f.by + here.by)) - here.y);
    weights += weight;
  }

  // Distance between a cell and where it is expected, in cells.
  float Misfit(const CellFrame& here) const {
    return Length(here.by * x - here.bx * y, here.ax * y - here.ay * x) / (weights * here.Area());
  }
};

Surroundings Around(const CellMap& map, const GrownCells& cells, const GrownCell& cell, int width_px,
                    int height_px) {
  const CellFrame& f = cell.fit.frame;
  Surroundings around;
  for (int k = 0; k < 9; ++k) {
    const int other = map.At(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
    const float dr = static_cast<float>(k / 3 - 1), dc = static_cast<float>(k % 3 - 1);
    const float x = f.x + dc * f.ax + dr * f.bx, y = f.y + dc * f.ay + dr * f.by;
    const bool outside =
        x < 0 || y < 0 || x > static_cast<float>(width_px - 1) || y > static_cast<float>(height_px - 1);
    around.present[k] = other >= 0 || outside;
    if (k != 4 && other >= 0) around.Add(f, cells[other].fit, dr, dc);
  }
  return around;
}

Evidence EvidenceFor(const CellFit& fit, const Surroundings& around) {
  const auto& p = around.present;
  const auto count = [&p](std::initializer_list<int> places) {
    return static_cast<float>(std::count_if(places.begin(), places.end(), [&p](int k) { return p[k]; }));
  };
  const float quads = static_cast<float>(p[0] && p[1] && p[3]) + static_cast<float>(p[1] && p[2] && p[5]) +
                      static_cast<float>(p[3] && p[6] && p[7]) + static_cast<float>(p[5] && p[7] && p[8]);
  const CellFrame& f = fit.frame;
  const float height_px = f.Area() / std::max(Length(f.ax, f.ay), Length(f.bx, f.by));
  const float share = 1 / around.known;
  const float light = std::min(std::abs(std::log(fit.gain / (share * around.light))), 2.0f);
  return {std::clamp(fit.explained, 0.0f, 1.0f),
          share * around.explained,
          RelativeLead(fit),
          share * around.lead,
          count({0, 1, 2, 3, 5, 6, 7, 8}) / 8,
          count({1, 3, 5, 7}) / 4,
          quads / 4,
          std::log(std::clamp(around.Misfit(f), 0.01f, 1.0f)),
          std::log(std::max(light, 0.005f)),
          std::log(std::clamp(share * around.shape, 0.02f, 2.0f)),
          std::log(fit.sigma_px / height_px)};
}

// Logarithm of the odds that a cell is where it was found, by what it shows itself and how it lies among the
// cells around. The weights were fitted to ray-traced views with known truth.
float LogOdds(const CellFit& fit, const Surroundings& around) {
  static constexpr float kConstant = -10.78f;
  static constexpr Evidence kWeights = {2.15f, 4.38f,  1.28f,  3.51f,  2.43f, 1.13f,
                                        1.36f, -0.36f, -0.23f, -0.69f, -0.22f};
  if (around.known == 0) return 0;
  const Evidence evidence = EvidenceFor(fit, around);
  float odds = kConstant;
  for (int k = 0; k < kReasons; ++k) odds += kWeights[k] * evidence[k];
  return odds;
}

// Probability that a cell is where it was found. Cells are right or wrong together, so each leans on those
// around it; one without any is not believed. How much was fitted to views of the synthetic studio, the scale
// to ray-traced views.
float Confidence(const CellMap& map, const GrownCells& cells, const GrownCell& cell) {
  constexpr float kOwn = 0.93f, kAround = 0.37f, kConstant = -1.6f;
  float sum = 0, known = 0;
  for (int k = 0; k < 9; ++k) {
    const int other = map.At(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
    if (k == 4 || other < 0) continue;
    sum += cells[other].log_odds;
    known += 1;
  }
  if (known == 0) return 0;
  return 1 / (1 + std::exp(-(kOwn * cell.log_odds + kAround * sum / known + kConstant)));
}

// Whether a cell and all around it are those that `stays` marks.
bool AllStay(const CellMap& map, const std::vector<bool>& stays, const GrownCell& cell) {
  for (int k = 0; k < 9; ++k) {
    const int other = map.At(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
    if (other >= 0 && !stays[other]) return false;
  }
  return true;
}

// Fits the centres once, and judges the cells there; those that stay are not fitted again.
void FillConfidences(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                     const std::vector<bool>& stays, GrownCells* cells) {
  SweepCenters(fitter, board, 0, stays, cells);
  const CellMap map(board, *cells);
  for (size_t k = 0; k < cells->size(); ++k) {
    if (stays[k]) continue;
    GrownCell& cell = (*cells)[k];
    cell.log_odds = LogOdds(cell.fit, Around(map, *cells, cell, width_px, height_px));
  }
  for (size_t k = 0; k < cells->size(); ++k) {
    GrownCell& cell = (*cells)[k];
    if (!AllStay(map, stays, cell)) cell.confidence = Confidence(map, *cells, cell);
  }
}

// Puts in the cells as they were judged where nothing has changed since that their fit has looked at; returns
// which those are.
std::vector<bool> TakeJudged(const Board& board, const Regrowth& again, GrownCells* cells) {
  constexpr int kReach = 2;  // of what matters to the fit of a centre
  const int columns = board.cols + 2 * kReach;
  const auto place = [columns](int row, int col) { return (row + kReach) * columns + col + kReach; };
  std::vector<uint8_t> changed(static_cast<size_t>(columns) * (board.rows + 2 * kReach), 0);
  for (const GrownCell& cell : again.judged) changed[place(cell.row, cell.col)] = 1;
  for (const GrownCell& cell : *cells) changed[place(cell.row, cell.col)] = 1;
  for (const GrownCell& cell : again.known) changed[place(cell.row, cell.col)] = 0;
  std::vector<bool> stays(cells->size());
  auto judged = again.judged.begin();
  for (size_t k = 0; k < cells->size(); ++k) {
    GrownCell& cell = (*cells)[k];
    const uint8_t* here = &changed[place(cell.row, cell.col)];
    int changes = 0;
    for (int d = -kReach; d <= kReach; ++d) changes += here[d] + here[d * columns];
    for (const int d : {-columns - 1, -columns + 1, columns - 1, columns + 1}) changes += here[d];
    if (changes > 0) continue;
    while (judged->row != cell.row || judged->col != cell.col) ++judged;
    cell = *judged;
    stays[k] = true;
  }
  return stays;
}

template <typename Keep>
void Filter(Keep keep, GrownCells* cells) {
  size_t kept = 0;
  for (size_t k = 0; k < cells->size(); ++k) {
    if (keep(k)) (*cells)[kept++] = (*cells)[k];
  }
  cells->resize(kept);
}

// Size of the 4-connected component of each cell.
std::vector<int> ComponentSizes(const Board& board, const GrownCells& cells) {
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

// Chance finds as many more small components as there is more to search, and each further cell of one is less
// likely by about the same factor.
int LeastComponent(int least, size_t cells) {
  constexpr float kCellsOfFew = 1000, kCellsPerE = 4.4f;
  const float more = kCellsPerE * std::log(std::max(1.0f, static_cast<float>(cells) / kCellsOfFew));
  return least + static_cast<int>(more);
}

}  // namespace

absl::Status CellRefinementOptions::Validate() const {
  if (!(min_confidence >= 0 && min_confidence < 1)) {
    return absl::InvalidArgumentError("refinement.min_confidence must lie in [0, 1)");
  }
  if (!(min_confidence_to_grow >= 0 && min_confidence_to_grow < 1)) {
    return absl::InvalidArgumentError("refinement.min_confidence_to_grow must lie in [0, 1)");
  }
  if (!(min_confidence_at_rims >= 0 && min_confidence_at_rims < 1)) {
    return absl::InvalidArgumentError("refinement.min_confidence_at_rims must lie in [0, 1)");
  }
  if (!(min_confidence_to_help >= 0 && min_confidence_to_help < 1)) {
    return absl::InvalidArgumentError("refinement.min_confidence_to_help must lie in [0, 1)");
  }
  if (min_component < 1) return absl::InvalidArgumentError("refinement.min_component must be at least 1");
  return absl::OkStatus();
}

Regrowth RegrowthFrom(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                      const CellRefinementOptions& options, const GrownCells& cells) {
  Regrowth again;
  again.judged = cells;
  FillConfidences(fitter, board, width_px, height_px, std::vector<bool>(cells.size()), &again.judged);
  const CellMap map(board, cells);
  const auto sure = [&](int row, int col) {
    const int k = map.At(row, col);
    return k >= 0 && again.judged[k].confidence >= options.min_confidence_to_grow;
  };
  for (const GrownCell& cell : cells) {
    int around = 0;
    for (int k = 0; k < 9; ++k) around += sure(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
    if (around == 9) {
      again.known.push_back(cell);
    } else if (sure(cell.row, cell.col)) {
      again.seeds.push_back({cell.row, cell.col, cell.fit.frame, cell.group});
    }
  }
  return again;
}

Regrowth RegrowthAtRims(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                        const CellRefinementOptions& options, const Regrowth& again, GrownCells cells) {
  Regrowth rims;
  rims.judged = std::move(cells);
  rims.known.reserve(rims.judged.size());
  const std::vector<bool> stays = TakeJudged(board, again, &rims.judged);
  FillConfidences(fitter, board, width_px, height_px, stays, &rims.judged);
  std::copy_if(rims.judged.begin(), rims.judged.end(), std::back_inserter(rims.known),
               [&](const GrownCell& cell) { return cell.confidence >= options.min_confidence_at_rims; });
  return rims;
}

void RefineCells(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                 const CellRefinementOptions& options, const Regrowth& again, GrownCells* cells) {
  FillConfidences(fitter, board, width_px, height_px, TakeJudged(board, again, cells), cells);
  const auto drop_below = [cells](float confidence) {
    Filter([&](size_t k) { return (*cells)[k].confidence >= confidence; }, cells);
  };
  drop_below(std::min(options.min_confidence_to_help, options.min_confidence));
  const std::vector<int> sizes = ComponentSizes(board, *cells);
  const int least = LeastComponent(options.min_component, cells->size());
  Filter([&](size_t k) { return sizes[k] >= least; }, cells);
  SweepCenters(fitter, board, kSettledCells, std::vector<bool>(cells->size()), cells);
  drop_below(options.min_confidence);
  // Neighbours may have pulled a cell at the rim out of the image.
  const float x_most = static_cast<float>(width_px) - 0.5f, y_most = static_cast<float>(height_px) - 0.5f;
  Filter(
      [&](size_t k) {
        const CellFrame& f = (*cells)[k].fit.frame;
        return f.x >= -0.5f && f.y >= -0.5f && f.x <= x_most && f.y <= y_most;
      },
      cells);
}

}  // namespace weft
