#include "alignment/template_build/board_panels.h"

#include <algorithm>
#include <deque>
#include <functional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr std::pair<int, int> kAround[] = {{-1, 0}, {0, -1}, {0, 1}, {1, 0}};
constexpr std::pair<int, int> kAllAround[] = {{-1, -1}, {-1, 0}, {-1, 1}, {0, -1},
                                              {0, 1},   {1, -1}, {1, 0},  {1, 1}};

// CellPieces of the cells for which `inside` holds; `joined` says whether two cells side by side hang
// together. Numbered by first cell, -1 outside.
struct CellPieces {
  std::vector<int> piece_of_cell;
  std::vector<int> size;
};
template <typename Inside, typename Joined, typename Steps>
CellPieces FindPieces(int rows, int cols, const Inside& inside, const Joined& joined, const Steps& steps) {
  CellPieces pieces{std::vector<int>(static_cast<size_t>(rows) * cols, -1), {}};
  std::deque<int> queue;
  for (int seed = 0; seed < rows * cols; ++seed) {
    if (pieces.piece_of_cell[seed] >= 0 || !inside(seed)) continue;
    const int piece = static_cast<int>(pieces.size.size());
    pieces.size.push_back(0);
    pieces.piece_of_cell[seed] = piece;
    queue.assign(1, seed);
    while (!queue.empty()) {
      const int cell = queue.front();
      queue.pop_front();
      ++pieces.size[piece];
      for (const auto& [down, right] : steps) {
        const int row = cell / cols + down, col = cell % cols + right;
        if (row < 0 || col < 0 || row >= rows || col >= cols) continue;
        const int next = row * cols + col;
        if (pieces.piece_of_cell[next] >= 0 || !inside(next) || !joined(cell, next)) continue;
        pieces.piece_of_cell[next] = piece;
        queue.push_back(next);
      }
    }
  }
  return pieces;
}

// What the clouds say of the places between cells: right of a cell, and below it.
class Cuts {
 public:
  Cuts(const std::vector<CellGrid>& grids, double limit_mm)
      : cols_(grids[0].cols), right_(grids[0].seen.size(), 0), below_(grids[0].seen.size(), 0) {
    for (const CellGrid& grid : grids) {
      for (int row = 0; row < grid.rows; ++row) {
        for (int col = 0; col < grid.cols; ++col) {
          const int cell = grid.Index(row, col);
          if (col + 1 < grid.cols) Assess(grid, cell, cell + 1, limit_mm, &right_[cell]);
          if (row + 1 < grid.rows) Assess(grid, cell, cell + grid.cols, limit_mm, &below_[cell]);
        }
      }
    }
  }

  bool Between(int a, int b) const {
    const int low = std::min(a, b);
    return (std::max(a, b) - low == cols_ ? below_ : right_)[low] > 0;
  }

 private:
  static void Assess(const CellGrid& grid, int a, int b, double limit_mm, int* votes) {
    if (!grid.seen[a] || !grid.seen[b]) return;
    *votes += (grid.position_mm[a] - grid.position_mm[b]).norm() > limit_mm ? 1 : -1;
  }

  int cols_;
  std::vector<int> right_, below_;  // clouds that say cut, less those that say joined
};

// Gives cells without a panel that of the cells beside them, ring by ring.
void GrowInto(const std::vector<bool>& free, const Cuts& cuts, BoardPanels* panels) {
  std::deque<int> queue;
  for (size_t cell = 0; cell < free.size(); ++cell) {
    if (panels->panel_of_cell[cell] >= 0) queue.push_back(static_cast<int>(cell));
  }
  while (!queue.empty()) {
    const int cell = queue.front();
    queue.pop_front();
    for (const auto& [down, right] : kAround) {
      const int row = cell / panels->cols + down, col = cell % panels->cols + right;
      if (row < 0 || col < 0 || row >= panels->rows || col >= panels->cols) continue;
      const int next = row * panels->cols + col;
      if (panels->panel_of_cell[next] >= 0 || !free[next] || cuts.Between(cell, next)) continue;
      panels->panel_of_cell[next] = panels->panel_of_cell[cell];
      queue.push_back(next);
    }
  }
}

// The cells of a panel within `reach` of which no cell lies outside the others' reach: closing by a square.
void CloseNotches(int reach, BoardPanels* panels) {
  const int rows = panels->rows + 2 * reach, cols = panels->cols + 2 * reach;
  const auto spread = [&](const std::vector<char>& in, int step, char value) {
    std::vector<char> out = in;
    for (int i = 0; i < rows * cols; ++i) {
      const int place = step == 1 ? i % cols : i / cols, end = step == 1 ? cols : rows;
      for (int k = std::max(-reach, -place); k <= reach && place + k < end && out[i] != value; ++k) {
        if (in[i + k * step] == value) out[i] = value;
      }
    }
    return out;
  };
  for (int panel = 0; panel < panels->panels; ++panel) {
    std::vector<char> in(static_cast<size_t>(rows) * cols, 0);
    for (int row = 0; row < panels->rows; ++row) {
      for (int col = 0; col < panels->cols; ++col) {
        in[(row + reach) * cols + col + reach] = panels->At(row, col) == panel;
      }
    }
    in = spread(spread(in, 1, 1), cols, 1);
    in = spread(spread(in, 1, 0), cols, 0);
    for (int row = 0; row < panels->rows; ++row) {
      for (int col = 0; col < panels->cols; ++col) {
        int& owner = panels->panel_of_cell[row * panels->cols + col];
        if (owner < 0 && in[(row + reach) * cols + col + reach] != 0) owner = panel;
      }
    }
  }
}

void FillHoles(double max_cells, BoardPanels* panels) {
  const CellPieces gaps = FindPieces(
      panels->rows, panels->cols, [&](int cell) { return panels->panel_of_cell[cell] < 0; },
      [](int, int) { return true; }, kAllAround);
  constexpr int kNone = -1, kOpen = -2;  // no panel met yet; the board's edge or two panels met
  std::vector<int> owner(gaps.size.size(), kNone);
  for (int row = 0; row < panels->rows; ++row) {
    for (int col = 0; col < panels->cols; ++col) {
      const int gap = gaps.piece_of_cell[row * panels->cols + col];
      if (gap < 0) continue;
      if (row == 0 || col == 0 || row + 1 == panels->rows || col + 1 == panels->cols) owner[gap] = kOpen;
      for (const auto& [down, right] : kAround) {
        const int panel = panels->At(row + down, col + right);
        if (panel < 0 || owner[gap] == panel) continue;
        owner[gap] = owner[gap] == kNone ? panel : kOpen;
      }
    }
  }
  for (size_t cell = 0; cell < gaps.piece_of_cell.size(); ++cell) {
    const int gap = gaps.piece_of_cell[cell];
    if (gap >= 0 && owner[gap] >= 0 && gaps.size[gap] <= max_cells) panels->panel_of_cell[cell] = owner[gap];
  }
}

// Keeps pieces of at least min_cells as panels. Returns how many cells were in smaller ones.
int KeepLarge(const CellPieces& pieces, int min_cells, BoardPanels* panels) {
  std::vector<int> panel_of_piece(pieces.size.size(), -1);
  int specks = 0;
  panels->panels = 0;
  for (size_t i = 0; i < pieces.size.size(); ++i) {
    if (pieces.size[i] >= min_cells) {
      panel_of_piece[i] = panels->panels++;
    } else {
      specks += pieces.size[i];
    }
  }
  for (size_t cell = 0; cell < pieces.piece_of_cell.size(); ++cell) {
    const int piece = pieces.piece_of_cell[cell];
    panels->panel_of_cell[cell] = piece < 0 ? -1 : panel_of_piece[piece];
  }
  return specks;
}

std::vector<bool> SeenInAny(const std::vector<CellGrid>& grids) {
  std::vector<bool> seen(grids[0].seen.size(), false);
  for (const CellGrid& grid : grids) {
    for (size_t cell = 0; cell < seen.size(); ++cell) seen[cell] = seen[cell] || grid.seen[cell];
  }
  return seen;
}

void CountFilled(const std::vector<bool>& seen, BoardPanels* panels) {
  for (size_t cell = 0; cell < seen.size(); ++cell) {
    panels->filled_cells += panels->panel_of_cell[cell] >= 0 && !seen[cell];
  }
}

}  // namespace

absl::Status PanelOptions::Validate() const {
  if (min_panel_cells < 1) return absl::InvalidArgumentError("min_panel_cells must be 1 or more");
  if (!(max_hole_mm2 >= 0)) return absl::InvalidArgumentError("max_hole_mm2 must be 0 or more");
  if (closing_cells < 0 || closing_cells > 20) {
    return absl::InvalidArgumentError("closing_cells must be from 0 to 20");
  }
  if (!(cut_pitches > 1)) return absl::InvalidArgumentError("cut_pitches must be above 1");
  return absl::OkStatus();
}

absl::StatusOr<BoardPanels> FindPanels(const std::vector<CellGrid>& grids, double cell_mm,
                                       const PanelOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (grids.empty()) return absl::InvalidArgumentError("no cloud to find panels in");
  BoardPanels panels{grids[0].rows, grids[0].cols, 0, {}};
  const std::vector<bool> seen = SeenInAny(grids);
  const Cuts cuts(grids, options.cut_pitches * cell_mm);
  // A stray pair of cells must not tie two panels together: cells at a cut wait until the panels are known.
  std::vector<bool> clear = seen;
  for (int cell = 0; cell < static_cast<int>(seen.size()); ++cell) {
    const bool right = (cell + 1) % panels.cols != 0 && cuts.Between(cell, cell + 1);
    const bool below = cell / panels.cols + 1 < panels.rows && cuts.Between(cell, cell + panels.cols);
    if (right || below) clear[cell] = false;
    if (right) clear[cell + 1] = false;
    if (below) clear[cell + panels.cols] = false;
  }
  panels.panel_of_cell.assign(seen.size(), -1);
  const CellPieces pieces = FindPieces(
      panels.rows, panels.cols, [&](int cell) { return clear[cell]; }, [](int, int) { return true; },
      kAround);
  KeepLarge(pieces, options.min_panel_cells, &panels);
  if (panels.panels == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("the clouds show no piece of ", options.min_panel_cells, " connected cells; they show ",
                     std::count(seen.begin(), seen.end(), true),
                     " cells in all. Are board and clouds of the same cloth?"));
  }
  GrowInto(seen, cuts, &panels);
  for (size_t cell = 0; cell < seen.size(); ++cell) {
    panels.speck_cells += seen[cell] && panels.panel_of_cell[cell] < 0;
  }
  CloseNotches(options.closing_cells, &panels);
  FillHoles(options.max_hole_mm2 / (cell_mm * cell_mm), &panels);
  CountFilled(seen, &panels);
  return panels;
}

absl::StatusOr<BoardPanels> PanelsFromLabels(const std::vector<uint8_t>& labels,
                                             const std::vector<CellGrid>& grids, double cell_mm,
                                             const PanelOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (grids.empty()) return absl::InvalidArgumentError("no cloud to find panels in");
  BoardPanels panels{grids[0].rows, grids[0].cols, 0, {}};
  if (labels.size() != grids[0].seen.size()) {
    return absl::InvalidArgumentError("the panel labels are not of the board's size");
  }
  panels.panel_of_cell.assign(labels.size(), -1);
  const auto same = [&](int a, int b) { return labels[a] == labels[b]; };
  const CellPieces pieces = FindPieces(
      panels.rows, panels.cols, [&](int cell) { return labels[cell] != 0; }, same, kAround);
  panels.speck_cells = KeepLarge(pieces, options.min_panel_cells, &panels);
  if (panels.panels == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("the panel image has no piece of ", options.min_panel_cells, " cells or more"));
  }
  FillHoles(options.max_hole_mm2 / (cell_mm * cell_mm), &panels);
  CountFilled(SeenInAny(grids), &panels);
  return panels;
}

}  // namespace weft
