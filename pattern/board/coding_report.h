// How well a board's windows can be told apart.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "pattern/board/board.h"

namespace weft {

struct CodingReportOptions {
  int samples = 300;  // windows per size whose nearest other window is looked for, over the whole board
  uint64_t seed = 1;  // of their choice

  absl::Status Validate() const;
};

// Distances (cells that differ) from sampled windows to the nearest other reading of the board, under the
// four rotations.
struct WindowDistances {
  int size = 0;     // of the window, in cells a side
  int samples = 0;  // 0 where the board has no two such windows
  int least = 0;
  double mean = 0;
  std::vector<int> count;  // [size * size + 1] samples by distance
};

struct CodingReport {
  int64_t windows = 0;      // of 3x3 cells, within panels where the board has any
  int64_t mirrored = 0;     // of them, those that read as a window of the board in a mirror
  int64_t one_away = 0;     // of them, those that one wrong colour can turn into another window
  double alias_odds = 0;    // that one wrong colour does so; every cell and colour equally likely
  double erasure_odds = 0;  // that a window with one cell erased fits more than one place
  std::array<int64_t, kCellColors> colors{};
  int64_t equal_neighbors = 0;      // pairs of 4-neighbours of one colour: the ink line alone parts them
  double equal_diagonal_share = 0;  // of diagonal neighbours
  std::vector<WindowDistances> distances;  // 3x3, 4x4, 5x5
};

// Clashing windows (Board::FindClashes) count as zero distance. Takes about a second for 300 x 900 cells.
absl::StatusOr<CodingReport> MakeCodingReport(const Board& board, const CodingReportOptions& options);

}  // namespace weft
