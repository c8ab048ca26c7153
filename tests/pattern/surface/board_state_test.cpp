#include "pattern/surface/board_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "tests/pattern/board/test_boards.h"

namespace weft {
namespace {

constexpr int kStateWidthPx = 100, kStateHeightPx = 80;

// A cell in the middle of the image; `mark` tells it from others.
ViewCell ViewCellAt(int row, int col, float confidence = 1, int mark = 0) {
  ViewCell cell;
  cell.row = row;
  cell.col = col;
  cell.fit.pose = {40, 30, 5, 0, 0, 5};
  cell.group = mark;
  cell.confidence = confidence;
  return cell;
}

// The same cells in a plain list and a map.
struct Model {
  struct Entry {
    float confidence;
    int mark;
  };
  std::vector<std::pair<int, int>> order;
  std::map<std::pair<int, int>, Entry> cells;

  void Filter(const std::function<bool(size_t)>& keep) {
    std::vector<std::pair<int, int>> kept;
    for (size_t k = 0; k < order.size(); ++k) {
      if (keep(k)) {
        kept.push_back(order[k]);
      } else {
        cells.erase(order[k]);
      }
    }
    order = std::move(kept);
  }
};

void ExpectAlike(const BoardState& state, const Model& model) {
  ASSERT_EQ(state.cells().size(), model.order.size());
  for (size_t k = 0; k < model.order.size(); ++k) {
    const ViewCell& cell = state.cells()[k];
    ASSERT_EQ(std::pair(cell.row, cell.col), model.order[k]) << "cell " << k;
    ASSERT_EQ(cell.group, model.cells.at(model.order[k]).mark) << "cell " << k;
  }
  const int border = BoardState::kBorder;
  for (int row = -border; row < state.board().rows + border; ++row) {
    for (int col = -border; col < state.board().cols + border; ++col) {
      const auto expected = std::find(model.order.begin(), model.order.end(), std::pair(row, col));
      const int index = expected == model.order.end() ? -1 : static_cast<int>(expected - model.order.begin());
      ASSERT_EQ(state.At(row, col), index) << row << " " << col;
      ASSERT_EQ(state.Find(row, col), index < 0 ? nullptr : &state.cells()[index]) << row << " " << col;
    }
  }
  for (int row = -1; row <= state.board().rows; ++row) {
    for (int col = -1; col <= state.board().cols; ++col) {
      uint32_t around = 0;
      for (int k = 0; k < 9; ++k) {
        if (k != 4 && model.cells.contains({row + k / 3 - 1, col + k % 3 - 1})) around |= 1u << k;
      }
      ASSERT_EQ(state.Around(row, col), around) << row << " " << col;
    }
  }
}

TEST(BoardStates, FollowAPlainModelOverRandomOperations) {
  const Board board = PlainBoard(9, 7);
  BoardState state(board, kStateWidthPx, kStateHeightPx);
  Model model;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> share(0, 1);
  for (int step = 0; step < 1500; ++step) {
    const float choice = share(random);
    if (choice < 0.8f) {
      const int row = static_cast<int>(random() % board.rows), col = static_cast<int>(random() % board.cols);
      if (model.cells.contains({row, col})) continue;
      const float confidence = share(random);
      state.Add(ViewCellAt(row, col, confidence, step));
      model.order.push_back({row, col});
      model.cells[{row, col}] = {confidence, step};
    } else if (choice < 0.88f) {
      state.Sort();
      std::sort(model.order.begin(), model.order.end());
    } else if (choice < 0.94f) {
      std::vector<bool> keep(model.order.size());
      for (size_t k = 0; k < keep.size(); ++k) keep[k] = share(random) < 0.7f;
      state.Filter([&](size_t k) { return keep[k]; });
      model.Filter([&](size_t k) { return keep[k]; });
    } else if (choice < 0.97f) {
      state.Rest();
      state.Wake();
    } else {
      const float least = 0.5f * share(random);
      state.Evict(least);
      model.Filter([&](size_t k) { return model.cells.at(model.order[k]).confidence >= least; });
    }
    ASSERT_NO_FATAL_FAILURE(ExpectAlike(state, model)) << "step " << step;
  }
}

TEST(BoardStates, EvictionKeepsCellsAtTheLimit) {
  const Board board = PlainBoard(5, 5);
  BoardState state(board, kStateWidthPx, kStateHeightPx);
  state.Add(ViewCellAt(0, 0, 0.5f));
  state.Add(ViewCellAt(0, 1, 0.499f));
  state.Evict(0.5f);
  ASSERT_EQ(state.cells().size(), 1u);
  EXPECT_EQ(state.cells()[0].col, 0);
}

TEST(BoardStates, KnowWhichPositionsLieInTheImage) {
  const Board board = PlainBoard(5, 5);
  const BoardState state(board, kStateWidthPx, kStateHeightPx);
  const auto in_image = [&](float x, float y) { return state.InImage({x, y, 5, 0, 0, 5}); };
  EXPECT_TRUE(in_image(0, 0));
  EXPECT_TRUE(in_image(kStateWidthPx - 1, kStateHeightPx - 1));
  EXPECT_FALSE(in_image(-0.01f, 5));
  EXPECT_FALSE(in_image(5, -0.01f));
  EXPECT_FALSE(in_image(kStateWidthPx - 0.99f, 5));
  EXPECT_FALSE(in_image(5, kStateHeightPx - 0.99f));
}

// The prior of a centre's fit has second and fourth differences along the axes, and mixed ones.
bool FitOfACenterLooks(int dr, int dc) { return std::abs(dr) + std::abs(dc) <= 2; }

TEST(BoardStates, AnAddedCellUnscoresThoseWhoseFitLooksAtIt) {
  const Board board = PlainBoard(7, 7);
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      BoardState state(board, kStateWidthPx, kStateHeightPx);
      for (int r = 0; r < board.rows; ++r) {
        for (int c = 0; c < board.cols; ++c) {
          if (r != row || c != col) state.Add(ViewCellAt(r, c));
        }
      }
      state.MarkScored();
      for (const ViewCell& cell : state.cells()) ASSERT_TRUE(state.IsScored(cell));
      state.Add(ViewCellAt(row, col));
      state.Rest();  // changes are kept
      state.Wake();
      for (const ViewCell& cell : state.cells())
        EXPECT_EQ(state.IsScored(cell), !FitOfACenterLooks(cell.row - row, cell.col - col));
    }
  }
}

TEST(BoardStates, ARemovedCellUnscoresThoseWhoseFitLookedAtIt) {
  const Board board = PlainBoard(7, 7);
  const int count = board.rows * board.cols;
  for (int gone = 0; gone < count; ++gone) {
    BoardState state(board, kStateWidthPx, kStateHeightPx);
    for (int k = 0; k < count; ++k) state.Add(ViewCellAt(k / board.cols, k % board.cols));
    state.MarkScored();
    state.Filter([gone](size_t k) { return k != static_cast<size_t>(gone); });
    const int row = gone / board.cols, col = gone % board.cols;
    for (const ViewCell& cell : state.cells())
      EXPECT_EQ(state.IsScored(cell), !FitOfACenterLooks(cell.row - row, cell.col - col));
    state.MarkScored();
    state.Sort();
    for (const ViewCell& cell : state.cells()) EXPECT_TRUE(state.IsScored(cell)) << "sorting changes nothing";
  }
}

TEST(BoardStates, RememberWhatGrowthTriedUntilTheCellGoes) {
  const Board board = PlainBoard(5, 5);
  BoardState state(board, kStateWidthPx, kStateHeightPx);
  state.BestExplained(1, 1) = 0.4f;
  state.Tried(1, 1) = 5;
  state.BestExplained(2, 2) = 0.8f;
  state.Tried(2, 2) = 7;
  state.Add(ViewCellAt(2, 2));
  state.Filter([](size_t) { return false; });
  EXPECT_EQ(state.BestExplained(2, 2), 0);
  EXPECT_EQ(state.Tried(2, 2), 0u);
  EXPECT_EQ(state.BestExplained(1, 1), 0.4f);
  state.ForgetAttempts();
  EXPECT_EQ(state.BestExplained(1, 1), 0);
  EXPECT_EQ(state.Tried(1, 1), 0u);
}

class MissingCells : public testing::Test {
 protected:
  static CellPose At(float x, float y) { return {x, y, 5, 0, 0, 5}; }

  const Board board_ = PlainBoard(6, 6);
  BoardState state_{board_, kStateWidthPx, kStateHeightPx, true};
};

TEST_F(MissingCells, AreListedByRowAndColumnWithTheLastReason) {
  state_.Miss(4, 1, At(10, 20), WhyMissing::kMoved);
  state_.Miss(2, 5, At(30, 40), WhyMissing::kOtherInk);
  state_.Miss(2, 3, At(50, 60), WhyMissing::kTooSmall);
  state_.Miss(4, 1, At(11, 21), WhyMissing::kTaken);
  const std::vector<MissingCell> missing = state_.Missing();
  ASSERT_EQ(missing.size(), 3u);
  EXPECT_EQ(std::pair(missing[0].row, missing[0].col), std::pair(2, 3));
  EXPECT_EQ(missing[0].why, WhyMissing::kTooSmall);
  EXPECT_EQ(std::pair(missing[1].row, missing[1].col), std::pair(2, 5));
  EXPECT_EQ(missing[1].why, WhyMissing::kOtherInk);
  EXPECT_EQ(std::pair(missing[2].row, missing[2].col), std::pair(4, 1));
  EXPECT_EQ(missing[2].why, WhyMissing::kTaken);
  EXPECT_EQ(std::pair(missing[2].x_px, missing[2].y_px), std::pair(11.0f, 21.0f));
}

TEST_F(MissingCells, AreThoseThatAreStillMissing) {
  state_.Miss(1, 1, At(10, 20), WhyMissing::kMoved);
  state_.Miss(1, 2, At(15, 20), WhyMissing::kMoved);
  state_.Add(ViewCellAt(1, 1));
  ASSERT_EQ(state_.Missing().size(), 1u);
  EXPECT_EQ(state_.Missing()[0].col, 2);
}

TEST_F(MissingCells, ThatWereRemovedWereNotSure) {
  ViewCell outside = ViewCellAt(3, 4);
  outside.fit.pose = At(-2, 5);
  state_.Add(ViewCellAt(3, 3));
  state_.Add(outside);
  state_.Filter([](size_t) { return false; });
  ASSERT_EQ(state_.Missing().size(), 1u);
  EXPECT_EQ(state_.Missing()[0].col, 3);
  EXPECT_EQ(state_.Missing()[0].why, WhyMissing::kUnsure);
}

TEST_F(MissingCells, AreNotedInTheImageOnly) {
  state_.Miss(1, 1, At(-0.5f, 20), WhyMissing::kNoFit);
  state_.Miss(1, 2, At(kStateWidthPx, 20), WhyMissing::kNoFit);
  state_.Miss(1, 3, At(20, kStateHeightPx), WhyMissing::kNoFit);
  state_.Miss(1, 4, At(20, kStateHeightPx - 1), WhyMissing::kNoFit);
  ASSERT_EQ(state_.Missing().size(), 1u);
  EXPECT_EQ(state_.Missing()[0].col, 4);
}

TEST_F(MissingCells, AreNotNotedUnlessAskedFor) {
  BoardState silent(board_, kStateWidthPx, kStateHeightPx);
  silent.Miss(1, 1, At(10, 20), WhyMissing::kMoved);
  EXPECT_TRUE(silent.Missing().empty());
}

}  // namespace
}  // namespace weft
