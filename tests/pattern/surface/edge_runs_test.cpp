#include "pattern/surface/edge_runs.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/pattern/board/test_boards.h"

namespace weft {
namespace {

class EdgeRuns : public ::testing::Test {
 protected:
  // The cells that a drawing shows, one line per row of the board.
  BoardState Drawn(const std::vector<std::string>& drawing) const {
    BoardState state(board_, 100, 100);
    for (size_t row = 0; row < drawing.size(); ++row) {
      for (size_t col = 0; col < drawing[row].size(); ++col) {
        if (drawing[row][col] == '.') continue;
        ViewCell cell;
        cell.row = static_cast<int>(row);
        cell.col = static_cast<int>(col);
        state.Add(cell);
      }
    }
    return state;
  }

  const Board board_ = PlainBoard(12, 14);
};

TEST_F(EdgeRuns, AreAsLongAsTheEdgeThatACellIsAt) {
  const BoardState state = Drawn({"..............",  //
                                  "..#..###......",  //
                                  ".##########...",  //
                                  ".##########...",  //
                                  ".##########...",  //
                                  ".##########...",  //
                                  ".#########....",  //
                                  "..........#..."});
  EXPECT_EQ(RunAtEdge(state, 1, 2), 1);
  for (int col = 5; col < 8; ++col) EXPECT_EQ(RunAtEdge(state, 1, col), 3);
  EXPECT_EQ(RunAtEdge(state, 4, 4), kNoEdge);
  EXPECT_EQ(RunAtEdge(state, 2, 2), kNoEdge) << "a cell follows above it";
  EXPECT_EQ(RunAtEdge(state, 5, 10), 4) << "rows 2 to 5 of the last column";
  EXPECT_EQ(RunAtEdge(state, 3, 10), 4);
  EXPECT_EQ(RunAtEdge(state, 6, 4), kLongestRun) << "nine columns";
  EXPECT_EQ(RunAtEdge(state, 4, 1), 5) << "rows 2 to 6 of the first column";
  EXPECT_EQ(RunAtEdge(state, 7, 10), kNoEdge) << "no neighbour at all";
}

TEST_F(EdgeRuns, TheShorterRunOfACornerCounts) {
  const BoardState state = Drawn({"####",  //
                                  "####"});
  EXPECT_EQ(RunAtEdge(state, 0, 0), 2);
  EXPECT_EQ(RunAtEdge(state, 0, 1), 4);
}

}  // namespace
}  // namespace weft
