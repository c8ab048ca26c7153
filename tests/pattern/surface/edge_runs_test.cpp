#include "pattern/surface/edge_runs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/pattern/board/test_boards.h"

namespace weft {
namespace {

class EdgeRuns : public ::testing::Test {
 protected:
  // The cells that a drawing shows, one line per row of the board.
  BoardState Drawn(const std::vector<std::string>& drawing, float confidence = 0.9f) const {
    BoardState state(board_, 100, 100);
    for (size_t row = 0; row < drawing.size(); ++row) {
      for (size_t col = 0; col < drawing[row].size(); ++col) {
        if (drawing[row][col] == '.') continue;
        ViewCell cell;
        cell.row = static_cast<int>(row);
        cell.col = static_cast<int>(col);
        cell.confidence = confidence;
        cell.is_read = drawing[row][col] == 'r';
        state.Add(cell);
      }
    }
    return state;
  }

  static float LogOdds(float confidence) { return std::log(confidence / (1 - confidence)); }

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
  EXPECT_EQ(RunAtEdge(state, 4, 4), kInside);
  EXPECT_EQ(RunAtEdge(state, 2, 2), kInside) << "a cell follows above it";
  EXPECT_EQ(RunAtEdge(state, 5, 10), 4) << "rows 2 to 5 of the last column";
  EXPECT_EQ(RunAtEdge(state, 3, 10), 4);
  EXPECT_EQ(RunAtEdge(state, 6, 4), kLongestRun) << "nine columns";
  EXPECT_EQ(RunAtEdge(state, 4, 1), 5) << "rows 2 to 6 of the first column";
  EXPECT_EQ(RunAtEdge(state, 7, 10), kInside) << "no neighbour at all";
}

TEST_F(EdgeRuns, TheShorterRunOfACornerCounts) {
  const BoardState state = Drawn({"####",  //
                                  "####"});
  EXPECT_EQ(RunAtEdge(state, 0, 0), 2);
  EXPECT_EQ(RunAtEdge(state, 0, 1), 4);
}

TEST_F(EdgeRuns, ShortRunsAreLessSureAndLongOnesMore) {
  const BoardState state = Drawn({"#.......######",  //
                                  "##############",  //
                                  "##############",  //
                                  "##############"});
  const auto gain = [&](int row, int col) {
    return LogOdds(ConfidenceInRun(state, *state.Find(row, col))) - LogOdds(0.9f);
  };
  EXPECT_NEAR(gain(0, 0), -2, 1e-4);
  EXPECT_NEAR(gain(0, 10), 0.5, 1e-4);
  EXPECT_NEAR(gain(2, 7), 0.5, 1e-4);
  const BoardState certain = Drawn({"#", "#"}, 1);
  EXPECT_FLOAT_EQ(ConfidenceInRun(certain, *certain.Find(0, 0)), 1);
  const BoardState hopeless = Drawn({"#", "#"}, 0);
  EXPECT_EQ(ConfidenceInRun(hopeless, *hopeless.Find(0, 0)), 0);
}

TEST_F(EdgeRuns, CellsThatWereReadNeedNoOthersBesideThem) {
  const BoardState state = Drawn({"r.#...........",  //
                                  "##############",  //
                                  "##############"});
  EXPECT_FLOAT_EQ(ConfidenceInRun(state, *state.Find(0, 0)), 0.9f);
  EXPECT_LT(ConfidenceInRun(state, *state.Find(0, 2)), 0.6f);
}

TEST_F(EdgeRuns, EvictionLooksAtAllRunsBeforeAnyCellGoes) {
  BoardState state = Drawn({"#.##....######",  //
                            "##############",  //
                            "##############",  //
                            "##############"});
  EvictUnsure(0.85f, &state);
  EXPECT_LT(state.At(0, 0), 0);
  EXPECT_LT(state.At(0, 2), 0);
  EXPECT_LT(state.At(0, 3), 0);
  for (int col = 8; col < 14; ++col) EXPECT_GE(state.At(0, col), 0);
  for (int col = 0; col < 14; ++col) EXPECT_GE(state.At(1, col), 0) << col;
  for (const ViewCell& cell : state.cells()) EXPECT_EQ(cell.confidence, 0.9f);
  ScoreRuns(&state);
  for (const ViewCell& cell : state.cells()) EXPECT_NE(cell.confidence, 0.9f) << cell.row << " " << cell.col;
}

}  // namespace
}  // namespace weft
