// Look-up of patches of colours on a board.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "pattern/board/board.h"
#include "pattern/board/strip_index.h"
#include "pattern/board/window_code.h"

namespace weft {

// A cell of the board.
struct BoardCell {
  int row = 0;
  int col = 0;

  auto operator<=>(const BoardCell&) const = default;
};

// Board pose of a lattice. Its cell (i, j) (i down, j right, as seen) is the board cell (row, col) +
// T^quarter_turns (i, j) with T (i, j) = (j, -i).
struct BoardPose {
  int row = 0;
  int col = 0;
  int quarter_turns = 0;

  auto operator<=>(const BoardPose&) const = default;

  BoardCell ToBoard(int i, int j) const {
    switch (quarter_turns & 3) {
      case 0:
        return {row + i, col + j};
      case 1:
        return {row + j, col - i};
      case 2:
        return {row - i, col - j};
      default:
        return {row - j, col + i};
    }
  }
};

// Precomputed look-up over one board. Build once per board, then use from any number of threads.
class BoardIndex {
 public:
  // InvalidArgument for an invalid board and for one whose 3x3 windows are not unique (names the clash).
  static absl::StatusOr<BoardIndex> Build(const Board& board);

  const Board& board() const { return board_; }

  // The pose under which lattice cells (0..2, 0..2) have these colours; nothing where the board has no such
  // window.
  std::optional<BoardPose> Find(const Window& window) const { return FindCode(WindowCode(window)); }
  std::optional<BoardPose> FindCode(uint32_t code) const;

  // Narrower windows of the board.
  const StripIndex& strips(StripIndex::Shape shape) const { return *strips_[static_cast<int>(shape)]; }

 private:
  // Open addressing, two slots of space per code.
  struct Slot {
    uint32_t code = kWindowCodes;  // free
    uint32_t window = 0;           // (row * cols + col) * 4 + quarter turns
  };

  size_t SlotOf(uint32_t code) const { return (code * 0x9e3779b1u) >> shift_; }
  // False where the code is there already.
  bool Insert(uint32_t code, uint32_t window);

  Board board_;
  std::vector<Slot> slots_;
  int shift_ = 0;
  std::array<std::shared_ptr<const StripIndex>, 2> strips_;  // by shape; copies of the index share it
};

}  // namespace weft
