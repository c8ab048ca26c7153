// Boards made to be decoded: unique windows that are hard to mistake for each other.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "pattern/board/board.h"

namespace weft {

struct BoardGenerationOptions {
  int rows = 0;
  int cols = 0;
  double cell_mm = 2.7;
  double square_fraction = 0.75;
  // [rows][cols], 0 outside of all panels. Only windows within one panel need be unique, over all panels;
  // empty: the whole board is one panel.
  std::vector<uint8_t> panels;
  // Boards that garments of the same take may have: no window of the new one reads as one of theirs.
  std::vector<Board> apart_from;
  uint64_t seed = 1;

  // InvalidArgument names the field.
  absl::Status Validate() const;
};

// A share of the work done, 0 to 1; returns false to stop.
using BoardProgress = std::function<bool(double)>;

// No equal 4-neighbours; 3x3 windows (within panels) unique under rotation and none its own rotation.
// Among such boards one with equal shares of the colours and few windows that a single wrong colour or a
// mirror turns into another window. Greedy with a look-ahead of one cell. The same options make the same
// board. ResourceExhausted where no such board is found: 1,616,000 windows exist, 1000 x 1000 cells take
// 996,000 of them. Cancelled when `progress` says so.
absl::StatusOr<Board> GenerateBoard(const BoardGenerationOptions& options,
                                    const BoardProgress& progress = nullptr);

}  // namespace weft
