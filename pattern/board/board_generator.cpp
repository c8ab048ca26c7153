// Search for boards with unique windows.
#include <algorithm>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "base/random.h"
#include "base/status_macros.h"
#include "pattern/board/board.h"
#include "pattern/board/window_code.h"

namespace weft {
namespace {

// Fills the board cell by cell in reading order; a cell completes the window whose lower right it is. Where
// no colour fits, the last cells are taken back, the more the longer the search is stuck.
class BoardSearch {
 public:
  BoardSearch(Board* board, uint64_t seed) : board_(*board), random_(seed), used_(kWindowCodes, false) {}

  bool Run() {
    const size_t cells = board_.cells.size();
    const size_t max_steps = 40 * cells + 10000;
    size_t take_back = 1;
    size_t furthest = 0;
    size_t next = 0;
    for (size_t step = 0; next < cells; ++step) {
      if (step > max_steps) return false;
      if (Place(next)) {
        ++next;
        if (next > furthest) {
          furthest = next;
          take_back = 1;
        }
        continue;
      }
      const size_t first = next - std::min(next, take_back);
      while (next > first) Remove(--next);
      take_back = std::min<size_t>(take_back + take_back / 2 + 1, 4 * board_.cols);
    }
    return true;
  }

 private:
  bool Place(size_t index) {
    const int row = static_cast<int>(index / board_.cols), col = static_cast<int>(index % board_.cols);
    std::array<uint8_t, kCellColors> order = {0, 1, 2, 3, 4, 5, 6};
    for (int i = kCellColors - 1; i > 0; --i) std::swap(order[i], order[random_.Below(i + 1)]);
    for (const uint8_t candidate : order) {
      const CellColor color = static_cast<CellColor>(candidate);
      if (col > 0 && board_.at(row, col - 1) == color) continue;
      if (row > 0 && board_.at(row - 1, col) == color) continue;
      board_.cells[index] = color;
      if (row < 2 || col < 2) return true;
      const auto codes = RotatedCodes(BoardWindow(board_, row - 2, col - 2));
      const bool turns_into_itself = codes[0] == codes[1] || codes[0] == codes[2];
      const uint32_t canonical = *std::min_element(codes.begin(), codes.end());
      if (turns_into_itself || used_[canonical]) continue;
      used_[canonical] = true;
      return true;
    }
    return false;
  }

  void Remove(size_t index) {
    const int row = static_cast<int>(index / board_.cols), col = static_cast<int>(index % board_.cols);
    if (row < 2 || col < 2) return;
    const auto codes = RotatedCodes(BoardWindow(board_, row - 2, col - 2));
    used_[*std::min_element(codes.begin(), codes.end())] = false;
  }

  Board& board_;
  Random random_;
  std::vector<bool> used_;  // by canonical code
};

}  // namespace

absl::StatusOr<Board> GenerateBoard(int rows, int cols, double cell_mm, uint64_t seed) {
  Board board;
  board.rows = rows;
  board.cols = cols;
  board.cell_mm = cell_mm;
  if (rows > 0 && cols > 0 && rows <= 4096 && cols <= 4096) {
    board.cells.assign(static_cast<size_t>(rows) * cols, CellColor::kRed);
  }
  WEFT_RETURN_IF_ERROR(board.Validate());
  // 6,464,682 windows have no equal 4-neighbours, four rotations each.
  constexpr size_t kDistinctWindows = 6464682 / 4;
  const size_t windows = static_cast<size_t>(rows - 2) * (cols - 2);
  if (windows > kDistinctWindows || !BoardSearch(&board, seed).Run()) {
    return absl::ResourceExhaustedError(
        absl::StrCat("no board of ", rows, "x", cols, " cells with unique windows was found (", windows,
                     " windows, ", kDistinctWindows, " exist); make it smaller or try another seed"));
  }
  board.id = board.ContentHash();
  return board;
}

}  // namespace weft
