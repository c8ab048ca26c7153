#include "pattern/board/board_index.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>

namespace weft {
namespace {

// What a camera sees that is turned by `quarter_turns` against the board: colours and board cells, 3x3.
struct View {
  Window colors;
  std::array<BoardCell, 9> cells;
};

View LookAt(const Board& board, int row, int col, int quarter_turns) {
  View view;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      int r = i, c = j;
      for (int turn = 0; turn < quarter_turns; ++turn) {
        const int down = r;
        r = c;
        c = 2 - down;
      }
      view.cells[3 * i + j] = {row + r, col + c};
      view.colors[3 * i + j] = board.at(row + r, col + c);
    }
  }
  return view;
}

TEST(BoardIndex, FindsTheCellsOfAllWindowsUpToTheBorder) {
  const Board board = *GenerateBoard(11, 17, 3, 2);
  const auto index = BoardIndex::Build(board);
  ASSERT_TRUE(index.ok()) << index.status();
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      for (int turn = 0; turn < 4; ++turn) {
        const View view = LookAt(board, row, col, turn);
        const auto pose = index->Find(view.colors);
        ASSERT_TRUE(pose.has_value()) << row << " " << col << " turned " << turn;
        for (int k = 0; k < 9; ++k) {
          EXPECT_EQ(pose->ToBoard(k / 3, k % 3), view.cells[k]) << row << " " << col << " turned " << turn;
        }
      }
    }
  }
}

TEST(BoardIndex, FindsOfRandomWindowsThoseOfTheBoardOnly) {
  const Board board = *GenerateBoard(150, 150, 3, 3);
  const auto index = BoardIndex::Build(board);
  ASSERT_TRUE(index.ok()) << index.status();
  std::map<Window, int> there;
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      for (int turn = 0; turn < 4; ++turn) ++there[LookAt(board, row, col, turn).colors];
    }
  }
  std::mt19937 random(4);
  int found = 0;
  for (int trial = 0; trial < 200000; ++trial) {
    Window window;
    for (CellColor& color : window) color = static_cast<CellColor>(random() % kCellColors);
    const bool is_found = index->Find(window).has_value();
    ASSERT_EQ(is_found, there.contains(window));
    found += is_found;
  }
  EXPECT_GT(found, 100) << "both answers were tried";
}

TEST(BoardIndex, LeavesOutWindowsThatAreCutApart) {
  Board board = *GenerateBoard(12, 14, 3, 5);
  board.panels.assign(static_cast<size_t>(board.rows) * board.cols, 0);
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) board.panels[row * board.cols + col] = col < 6 ? 1 : 2;
  }
  const auto index = BoardIndex::Build(board);
  ASSERT_TRUE(index.ok()) << index.status();
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      const bool cut = col < 6 && col + 2 >= 6;
      EXPECT_EQ(index->Find(LookAt(board, row, col, row % 4).colors).has_value(), !cut) << row << " " << col;
    }
  }
}

}  // namespace
}  // namespace weft
