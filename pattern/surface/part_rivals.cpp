#include "pattern/surface/part_rivals.h"

#include <algorithm>
#include <vector>

#include "pattern/fit/cell_check.h"
#include "pattern/surface/edge_runs.h"
#include "pattern/surface/occupied_positions.h"

namespace weft {
namespace {

// Cells beyond the edge of a garment are wrong one by one; longer rows are mostly its hem (as edge_runs.h has
// it). In the film of docs/decoding-accuracy.md, "Several garments", 25 of 3.7 million cells were another
// garment's without this.
constexpr int kDoubtfulRun = 3;
// Shares of explained variance that differ by less do not tell.
constexpr float kTie = 0.1f;

// The empty neighbour in direction k (as BoardState::Around) of a known cell, as the print around it goes on.
PredictedCell Continue(const BoardState& state, const ViewCell& cell, int k) {
  const int dr = k / 3 - 1, dc = k % 3 - 1;
  PredictedCell next{.row = cell.row + dr,
                     .col = cell.col + dc,
                     .pose = cell.fit.pose.Shifted(static_cast<float>(dc), static_cast<float>(dr))};
  const uint32_t around = state.Around(next.row, next.col);
  for (int n = 0; n < 9; ++n) next.in_sight[n] = n == 4 || (around >> n & 1) != 0 ? 1.0f : 0.0f;
  return next;
}

// Whether cloth of the cell's panel may lie there.
bool BelongsTo(const Board& board, const ViewCell& cell, int row, int col) {
  if (!board.Contains(row, col) || board.PartAt(row) != board.PartAt(cell.row)) return false;
  if (board.panels.empty()) return true;
  const auto panel = [&](int r, int c) { return board.panels[static_cast<size_t>(r) * board.cols + c]; };
  return panel(row, col) == panel(cell.row, cell.col);
}

}  // namespace

int EvictPartRivals(const CellFitter& fitter, BoardState* state) {
  const Board& board = state->board();
  if (board.parts.size() < 2) return 0;
  const auto& cells = state->cells();
  OccupiedPositions occupied(state->width_px(), state->height_px());
  for (const ViewCell& cell : cells) occupied.Take(cell.fit.pose, cell.row, cell.col);
  std::vector<bool> lost(cells.size(), false);
  for (const ViewCell& cell : cells) {
    const uint32_t around = state->Around(cell.row, cell.col);
    for (int k = 0; k < 9; ++k) {
      const int row = cell.row + k / 3 - 1, col = cell.col + k % 3 - 1;
      if (k == 4 || (around >> k & 1) != 0 || !BelongsTo(board, cell, row, col)) continue;
      const PredictedCell next = Continue(*state, cell, k);
      if (!state->InImage(next.pose)) continue;
      const int other = occupied.CellAt(next.pose);
      if (other < 0 || lost[other] || board.PartAt(cells[other].row) == board.PartAt(row)) continue;
      const FitLimits limits;
      const CellFit fit = fitter.Fit(next, limits);
      if (Reject(fit, limits) || !state->InImage(fit.pose) || occupied.CellAt(fit.pose) != other) continue;
      const bool is_doubtful = RunAtEdge(*state, cells[other].row, cells[other].col) <= kDoubtfulRun;
      lost[other] = fit.explained > cells[other].fit.explained + (is_doubtful ? -kTie : kTie);
    }
  }
  const auto gone = static_cast<int>(std::count(lost.begin(), lost.end(), true));
  if (gone > 0) state->Filter([&](size_t k) { return !lost[k]; });
  return gone;
}

}  // namespace weft
