#include "pattern/seeds/strip_decoder.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace weft {
namespace {

using Cells = std::array<int, 6>;

using Shape = StripIndex::Shape;

// A window of six cells of a patch. `cells` come as StripIndex reads them: those of an upright window as if
// the patch were turned.
struct StripWindow {
  int i, j;  // its upper left cell
  Shape shape;
  bool upright;
  Cells cells;

  // Windows along different lines have nothing in common; -1 for those of 2x3 cells.
  int Line() const {
    return shape == Shape::k2x3 ? -1 : (upright ? 2 * (j + kMiddle) + 1 : 2 * (i + kMiddle));
  }

  // The pose of lattice cell (0, 0), from that of the window's first cell.
  BoardPose PoseOf(const PackedPose& found, const Board& board) const {
    const int turns = upright ? (found.quarter_turns() + 3) & 3 : found.quarter_turns();
    const BoardPose here{found.cell() / board.cols, found.cell() % board.cols, turns};
    const BoardCell origin = here.ToBoard(-i, upright && shape == Shape::k2x3 ? -(j + 1) : -j);
    return {origin.row, origin.col, turns};
  }

 private:
  static constexpr int kMiddle = 1 << 24;
};

// The window of a patch with its upper left cell there, if it has all cells.
bool FindCells(const MeasuredPatch& patch, StripWindow* window) {
  const int width = window->shape == Shape::k2x3 ? 3 : 6, last_row = 6 / width - 1;
  for (int k = 0; k < 6; ++k) {
    const int a = k / width, b = k % width;
    const int cell = window->upright ? patch.CellAt(window->i + b, window->j + last_row - a)
                                     : patch.CellAt(window->i + a, window->j + b);
    if (cell < 0) return false;
    window->cells[k] = cell;
  }
  return true;
}

std::vector<StripWindow> WindowsOf(const MeasuredPatch& patch) {
  std::vector<StripWindow> windows;
  for (const PatchCell& cell : patch.lattice.cells) {
    for (const Shape shape : {Shape::k2x3, Shape::k1x6}) {
      for (const bool upright : {false, true}) {
        StripWindow window{cell.i, cell.j, shape, upright, {}};
        if (FindCells(patch, &window)) windows.push_back(window);
      }
    }
  }
  return windows;
}

// Windows that read one pose.
struct Vote {
  BoardPose pose;
  std::vector<int> windows;
};

// Counts what the windows read: as their likeliest inks say, or else with the weakest cell, where it is
// unclear, read as its runner-up. Most windows first, those with at least two.
std::vector<Vote> CountVotes(const MeasuredPatch& patch, const std::vector<StripWindow>& windows,
                             const BoardIndex& board) {
  constexpr float kUnclear = 4;
  struct Reading {
    BoardPose pose;
    int line, window;
    bool SameAs(const Reading& other) const { return line == other.line && pose == other.pose; }
  };
  std::vector<Reading> read;
  const auto add = [&](const std::array<int, 6>& colors, int w) {
    const StripWindow& window = windows[w];
    for (const PackedPose& pose : board.strips(window.shape).Find(StripIndex::Code(colors)))
      read.push_back({window.PoseOf(pose, board.board()), window.Line(), w});
  };
  for (size_t w = 0; w < windows.size(); ++w) {
    const Cells& cells = windows[w].cells;
    std::array<int, 6> colors;
    int weakest = 0;
    for (int k = 0; k < 6; ++k) {
      colors[k] = patch.readings[cells[k]].best;
      if (patch.readings[cells[k]].lead < patch.readings[cells[weakest]].lead) weakest = k;
    }
    add(colors, static_cast<int>(w));
    if (patch.readings[cells[weakest]].lead > kUnclear) continue;
    colors[weakest] = patch.readings[cells[weakest]].second;
    add(colors, static_cast<int>(w));
  }
  std::sort(read.begin(), read.end(), [](const Reading& s, const Reading& t) {
    return std::tie(s.line, s.pose, s.window) < std::tie(t.line, t.pose, t.window);
  });
  std::vector<Vote> votes;
  for (size_t first = 0, last; first < read.size(); first = last) {
    for (last = first + 1; last < read.size() && read[last].SameAs(read[first]);) ++last;
    if (last - first < 2) continue;
    votes.push_back({read[first].pose, {}});
    for (size_t k = first; k < last; ++k) votes.back().windows.push_back(read[k].window);
  }
  std::stable_sort(votes.begin(), votes.end(),
                   [](const Vote& s, const Vote& t) { return s.windows.size() > t.windows.size(); });
  return votes;
}

// Fills the cells of a vote's windows of which none is taken. A cell beside the strip may agree by chance, so
// one window is not enough for a center.
void FillCells(const Vote& vote, const std::vector<StripWindow>& windows, const std::vector<bool>& taken,
               DecodedPiece* piece) {
  std::vector<int> cells;
  for (const int w : vote.windows) {
    const Cells& of_window = windows[w].cells;
    if (std::any_of(of_window.begin(), of_window.end(), [&](int cell) { return taken[cell]; })) continue;
    cells.insert(cells.end(), of_window.begin(), of_window.end());
  }
  std::sort(cells.begin(), cells.end());
  for (size_t k = 0; k < cells.size(); ++k) {
    const bool first = k == 0 || cells[k] != cells[k - 1];
    if (first) piece->cells.push_back(cells[k]);
    if (first && k + 1 < cells.size() && cells[k] == cells[k + 1]) piece->centers.push_back(cells[k]);
  }
}

float Evidence(const MeasuredPatch& patch, const std::vector<int>& cells, const BoardPose& pose,
               const Board& board) {
  return std::accumulate(cells.begin(), cells.end(), 0.0f,
                         [&](float sum, int cell) { return sum + CellEvidence(patch, cell, pose, board); });
}

}  // namespace

std::vector<DecodedPiece> DecodeStrip(const MeasuredPatch& patch, const BoardIndex& board) {
  constexpr size_t kMostPieces = 48;
  const std::vector<StripWindow> windows = WindowsOf(patch);
  std::vector<Vote> votes = CountVotes(patch, windows, board);
  if (votes.size() > kMostPieces) votes.resize(kMostPieces);
  std::vector<DecodedPiece> pieces;
  std::vector<bool> taken(patch.lattice.cells.size(), false);
  for (const Vote& vote : votes) {
    DecodedPiece piece;
    piece.pose = vote.pose;
    FillCells(vote, windows, taken, &piece);
    if (piece.cells.empty()) continue;
    for (const int cell : piece.cells) taken[cell] = true;
    piece.evidence = Evidence(patch, piece.cells, vote.pose, board.board());
    float runner_up = 0;
    for (const Vote& other : votes) {
      if (other.pose != vote.pose)
        runner_up = std::max(runner_up, Evidence(patch, piece.cells, other.pose, board.board()));
    }
    piece.margin = piece.evidence - runner_up;
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

std::vector<PlacedCell> PlaceCells(const std::vector<std::pair<BoardCell, Keypoint>>& cells) {
  std::map<BoardCell, Keypoint> at(cells.begin(), cells.end());
  // From a cell to the next along the board, by one of its neighbours or the mean of both.
  const auto edge = [&at](const BoardCell& cell, int dr, int dc) -> std::optional<std::pair<float, float>> {
    const auto here = at.find(cell), next = at.find({cell.row + dr, cell.col + dc}),
               before = at.find({cell.row - dr, cell.col - dc});
    if (next == at.end() && before == at.end()) return std::nullopt;
    const Keypoint &to = (next != at.end() ? next : here)->second,
                   &from = (before != at.end() ? before : here)->second;
    const float steps = next != at.end() && before != at.end() ? 2.0f : 1.0f;
    return std::pair{(to.x_px - from.x_px) / steps, (to.y_px - from.y_px) / steps};
  };
  std::vector<PlacedCell> placed;
  for (const auto& [cell, point] : cells) {
    const auto a = edge(cell, 0, 1), b = edge(cell, 1, 0);
    if (!a || !b) continue;
    const CellPose pose{point.x_px, point.y_px, a->first, a->second, b->first, b->second};
    if (pose.Area() > 0) placed.push_back({cell.row, cell.col, pose});
  }
  return placed;
}

}  // namespace weft
