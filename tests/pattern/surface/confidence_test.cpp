#include "pattern/surface/confidence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "pattern/decoder.h"
#include "pattern/surface/edge_runs.h"
#include "tests/pattern/surface/rendered_surface.h"

namespace weft {
namespace {

constexpr int kKnownRows = 60, kKnownCols = 60, kKnownMiddle = 30;
constexpr int kFirst = kKnownMiddle - 10, kLast = kKnownMiddle + 10;  // rows and columns that are known

class Confidences : public testing::Test {
 protected:
  // The cell as it is fitted from `from` cells off its place along the columns.
  ViewCell Fitted(int row, int col, float from) const {
    PredictedCell expected{.row = row, .col = col, .pose = TrueFrame(photo_, board_, row, col)};
    expected.pose.x += from * expected.pose.ax;
    expected.pose.y += from * expected.pose.ay;
    expected.in_sight.fill(1);
    ViewCell cell;
    cell.row = row;
    cell.col = col;
    cell.fit = fitter_.get().Fit(expected, {.min_explained = -1e9f});
    return cell;
  }

  // All known cells where they are, but for those that `leaves_out`.
  template <typename LeavesOut>
  BoardState RightCells(const LeavesOut& leaves_out) const {
    BoardState state(board_, photo_.width_px, photo_.height_px);
    for (int row = kFirst; row <= kLast; ++row) {
      for (int col = kFirst; col <= kLast; ++col) {
        if (leaves_out(row, col)) continue;
        const ViewCell cell = Fitted(row, col, 0);
        EXPECT_TRUE(cell.fit.converged);
        state.Add(cell);
      }
    }
    return state;
  }

  const Photograph photo_{.width_px = 220, .height_px = 220, .pitch_px = 7};
  const Board board_ = *GenerateBoard(kKnownRows, kKnownCols, 3, 5);
  const FrameFitter fitter_{Render(photo_, board_), photo_, board_};
};

TEST_F(Confidences, AreLowerForAWrongCellThanForTheRightOnesAroundIt) {
  const auto is_planted = [](int row, int col) { return row % 5 == 0 && col % 5 == 0; };
  BoardState state = RightCells(is_planted);
  for (int row = kFirst; row <= kLast; ++row) {
    for (int col = kFirst; col <= kLast; ++col) {
      if (!is_planted(row, col)) continue;
      const ViewCell cell = Fitted(row, col, (row + col) % 2 == 0 ? 1.0f : -1.0f);
      if (cell.fit.converged) state.Add(cell);
    }
  }
  ScoreCells(fitter_.get(), &state);
  int wrong = 0;
  for (const ViewCell& cell : state.cells()) {
    if (ErrorCells(photo_, board_, cell) < 0.3) continue;
    ASSERT_TRUE(is_planted(cell.row, cell.col)) << cell.row << " " << cell.col;
    ++wrong;
    for (int k = 0; k < 9; ++k) {
      const ViewCell* right = state.Find(cell.row + k / 3 - 1, cell.col + k % 3 - 1);
      if (k == 4 || right == nullptr) continue;
      EXPECT_LT(cell.confidence, right->confidence) << cell.row << " " << cell.col;
    }
  }
  EXPECT_GT(wrong, 15);
}

TEST_F(Confidences, AreLowForAComponentOfWrongCells) {
  // Right cells in the left half; on the right a component that is read ten rows off.
  constexpr int kOff = 10;
  BoardState state = RightCells([](int, int col) { return col > kKnownMiddle; });
  for (int row = kKnownMiddle - 3; row <= kKnownMiddle; ++row) {
    for (int col = kKnownMiddle + 3; col < kKnownMiddle + 7; ++col) {
      PredictedCell expected{.row = row + kOff, .col = col, .pose = TrueFrame(photo_, board_, row, col)};
      expected.in_sight.fill(1);
      ViewCell cell;
      cell.row = expected.row;
      cell.col = col;
      cell.fit = fitter_.get().Fit(expected, {.min_explained = -1e9f});
      if (cell.fit.converged) state.Add(cell);
    }
  }
  ScoreCells(fitter_.get(), &state);
  int wrong = 0;
  for (const ViewCell& cell : state.cells()) {
    if (cell.col > kKnownMiddle) {
      EXPECT_LT(cell.confidence, DecodeOptions().confidence.min_to_grow) << cell.row << " " << cell.col;
      ++wrong;
    } else {
      EXPECT_GT(cell.confidence, 0.9) << cell.row << " " << cell.col;
    }
  }
  EXPECT_GT(wrong, 10);
}

TEST_F(Confidences, AreNoneForACellAlone) {
  BoardState state(board_, photo_.width_px, photo_.height_px);
  state.Add(Fitted(kKnownMiddle, kKnownMiddle, 0));
  state.Add(Fitted(kKnownMiddle + 2, kKnownMiddle + 1, 0));  // not beside it
  state.Add(Fitted(kKnownMiddle + 6, kKnownMiddle, 0));
  state.Add(Fitted(kKnownMiddle + 7, kKnownMiddle + 1, 0));
  ScoreCells(fitter_.get(), &state);
  EXPECT_EQ(state.Find(kKnownMiddle, kKnownMiddle)->confidence, 0);
  EXPECT_EQ(state.Find(kKnownMiddle + 2, kKnownMiddle + 1)->confidence, 0);
  EXPECT_GT(state.Find(kKnownMiddle + 6, kKnownMiddle)->confidence, 0);
  EXPECT_GT(state.Find(kKnownMiddle + 7, kKnownMiddle + 1)->confidence, 0);
}

TEST_F(Confidences, LeanOnTheCellsAround) {
  std::vector<float> confidences;
  for (const float around : {0.2f, 0.6f, 1.0f}) {
    BoardState state = RightCells([](int, int) { return false; });
    ScoreCells(fitter_.get(), &state);
    for (size_t k = 0; k < state.cells().size(); ++k) {
      ViewCell& cell = state.cell(k);
      if (cell.row != kKnownMiddle || cell.col != kKnownMiddle) cell.fit.explained = around;
    }
    const auto evidence = EvidenceFor(state, *state.Find(kKnownMiddle, kKnownMiddle));
    ASSERT_TRUE(evidence);
    EXPECT_NEAR((*evidence)[0], around, 1e-5);
    confidences.push_back(Confidence(*state.Find(kKnownMiddle, kKnownMiddle), evidence));
  }
  // Doubt falls by more than e each time.
  EXPECT_GT(std::log((1 - confidences[0]) / (1 - confidences[1])), 1);
  EXPECT_GT(std::log((1 - confidences[1]) / (1 - confidences[2])), 1);
}

// The row above the first known one, where only cells of these columns are.
constexpr int kRunAt = kKnownMiddle;

TEST_F(Confidences, AreLowerForShortRunsAlongAnEdge) {
  std::vector<float> confidences;
  for (const int run : {1, 2, 3, 4}) {
    BoardState state = RightCells(
        [run](int row, int col) { return row == kFirst && (col < kRunAt || col >= kRunAt + run); });
    ScoreCells(fitter_.get(), &state);
    confidences.push_back(state.Find(kFirst, kRunAt)->confidence);
  }
  EXPECT_TRUE(std::is_sorted(confidences.begin(), confidences.end()));
  EXPECT_GT((1 - confidences[0]) / (1 - confidences[3]), 2);
}

TEST_F(Confidences, AreHigherForACellThatWasReadThoughItLooksWrong) {
  const auto score = [this](bool is_read) {
    BoardState state =
        RightCells([](int row, int col) { return row == kKnownMiddle && col == kKnownMiddle; });
    ViewCell cell = Fitted(kKnownMiddle, kKnownMiddle, 1);
    cell.is_read = is_read;
    state.Add(cell);
    ScoreCells(fitter_.get(), &state);
    return state.Find(kKnownMiddle, kKnownMiddle)->confidence;
  };
  const float read = score(true), grown = score(false);
  EXPECT_GT(read, 0.99f);
  EXPECT_GT(read, grown);
}

TEST_F(Confidences, AreHighForCellsThatWereRead) {
  // Two cells side by side, nothing else around them.
  const auto score = [this](bool is_read) {
    BoardState state(board_, photo_.width_px, photo_.height_px);
    for (const int col : {kKnownMiddle, kKnownMiddle + 1}) {
      ViewCell cell = Fitted(kKnownMiddle, col, 0);
      cell.is_read = is_read;
      state.Add(cell);
    }
    ScoreCells(fitter_.get(), &state);
    return state.Find(kKnownMiddle, kKnownMiddle)->confidence;
  };
  EXPECT_GT(score(true), 0.997f);
  EXPECT_LT(score(false), 0.995f);
}

// What is told from a score in the tests below.
constexpr float kMark = -77;

// Marks all scores, and returns the cells as they are.
std::vector<ViewCell> Mark(BoardState* state) {
  std::vector<ViewCell> cells;
  for (size_t k = 0; k < state->cells().size(); ++k) {
    state->cell(k).confidence = kMark;
    cells.push_back(state->cells()[k]);
  }
  return cells;
}

// Expects that cells were scored again where the sweep of the centres looks after a change at one place, two
// cells far and one to the diagonals, and along edges.
void ExpectScoredAround(int row, int col, const std::vector<ViewCell>& before, const BoardState& state) {
  int near = 0;
  for (const ViewCell& cell : before) {
    if (cell.row == row && cell.col == col) continue;
    const ViewCell& after = *state.Find(cell.row, cell.col);
    const int dr = std::abs(cell.row - row), dc = std::abs(cell.col - col);
    const bool is_near = dr + dc <= 2, at_edge = RunAtEdge(state, cell.row, cell.col) != kNoEdge;
    EXPECT_EQ(after.confidence != kMark, is_near || at_edge) << dr << " " << dc;
    near += is_near;
    if (is_near) continue;
    EXPECT_TRUE(SamePose(after.fit.pose, cell.fit.pose)) << dr << " " << dc;
    EXPECT_EQ(after.fit.explained, cell.fit.explained);
    EXPECT_EQ(after.fit.sigma_px, cell.fit.sigma_px);
  }
  EXPECT_EQ(near, 12);
}

TEST_F(Confidences, AreScoredAnewNearAnAddedCellOnly) {
  BoardState state = RightCells([](int row, int col) { return row == kKnownMiddle && col == kKnownMiddle; });
  ScoreCells(fitter_.get(), &state);
  const std::vector<ViewCell> before = Mark(&state);
  state.Add(Fitted(kKnownMiddle, kKnownMiddle, 0));
  ScoreCells(fitter_.get(), &state);
  ExpectScoredAround(kKnownMiddle, kKnownMiddle, before, state);
  EXPECT_GT(state.Find(kKnownMiddle, kKnownMiddle)->confidence, 0.9f);
}

TEST_F(Confidences, AreScoredAnewNearARemovedCellOnly) {
  BoardState state = RightCells([](int, int) { return false; });
  ScoreCells(fitter_.get(), &state);
  const std::vector<ViewCell> before = Mark(&state);
  const size_t gone = static_cast<size_t>(state.At(kKnownMiddle, kKnownMiddle));
  state.Filter([gone](size_t k) { return k != gone; });
  ScoreCells(fitter_.get(), &state);
  ExpectScoredAround(kKnownMiddle, kKnownMiddle, before, state);
}

TEST_F(Confidences, StayWhereNothingHasChanged) {
  BoardState state = RightCells([](int, int) { return false; });
  ScoreCells(fitter_.get(), &state);
  for (const ViewCell& cell : state.cells()) EXPECT_TRUE(state.IsScored(cell));
  const std::vector<ViewCell> before = Mark(&state);
  ScoreCells(fitter_.get(), &state);
  for (const ViewCell& cell : before) {
    const ViewCell& after = *state.Find(cell.row, cell.col);
    EXPECT_TRUE(SamePose(after.fit.pose, cell.fit.pose));
    EXPECT_EQ(after.confidence == kMark, RunAtEdge(state, cell.row, cell.col) == kNoEdge);
  }
}

}  // namespace
}  // namespace weft
