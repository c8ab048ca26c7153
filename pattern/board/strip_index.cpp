#include "pattern/board/strip_index.h"

#include <algorithm>

#include "pattern/board/board_index.h"

namespace weft {
namespace {

constexpr uint32_t kCodes = 117649;  // 7^6

// Whether a window from one cell to another is on the board, and printed on one panel.
bool HasWindow(const Board& board, const BoardCell& first, const BoardCell& last) {
  if (!board.Contains(last.row, last.col)) return false;
  if (board.panels.empty()) return true;
  const auto [r0, r1] = std::minmax(first.row, last.row);
  const auto [c0, c1] = std::minmax(first.col, last.col);
  const uint8_t panel = board.panels[static_cast<size_t>(first.row) * board.cols + first.col];
  for (int row = r0; row <= r1; ++row) {
    for (int col = c0; col <= c1; ++col) {
      if (board.panels[static_cast<size_t>(row) * board.cols + col] != panel) return false;
    }
  }
  return panel != 0;
}

// Calls visit(code, pose) for all windows of the board that are so many columns wide.
template <typename Visit>
void ForEachWindow(const Board& board, int width, const Visit& visit) {
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      for (int turn = 0; turn < 4; ++turn) {
        const BoardPose pose{row, col, turn};
        if (!HasWindow(board, {row, col}, pose.ToBoard(5 / width, width - 1))) continue;
        std::array<int, 6> colors;
        for (int k = 0; k < 6; ++k) {
          const BoardCell at = pose.ToBoard(k / width, k % width);
          colors[k] = static_cast<int>(board.at(at.row, at.col));
        }
        visit(StripIndex::Code(colors), PackedPose(row * board.cols + col, turn));
      }
    }
  }
}

}  // namespace

StripIndex::StripIndex(const Board& board, Shape shape) : first_(kCodes + 1, 0) {
  const int width = shape == Shape::k2x3 ? 3 : 6;
  ForEachWindow(board, width, [this](uint32_t code, PackedPose) { ++first_[code + 1]; });
  for (uint32_t code = 0; code < kCodes; ++code) first_[code + 1] += first_[code];
  poses_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  ForEachWindow(board, width, [&](uint32_t code, PackedPose pose) { poses_[next[code]++] = pose; });
}

}  // namespace weft
