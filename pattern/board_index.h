// Look-up of patches of colours on a board.
#pragma once

#include "absl/status/statusor.h"
#include "pattern/board.h"

namespace weft {

// Precomputed look-up over one board. Build once per board, then use from any number of threads.
class BoardIndex {
 public:
  // InvalidArgument for an invalid board and for one whose 3x3 windows are not unique (names the clash).
  static absl::StatusOr<BoardIndex> Build(const Board& board);

  const Board& board() const { return board_; }

 private:
  Board board_;
};

}  // namespace weft
