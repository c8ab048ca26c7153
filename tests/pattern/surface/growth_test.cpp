#include "pattern/surface/growth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/pattern/surface/rendered_surface.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int kRows = 60, kCols = 60, kMiddle = 30;

// A photograph of the middle of a board, about 30 by 28 cells.
class Growths : public testing::Test {
 protected:
  BoardState EmptyState() const { return {board_, photo_.width_px, photo_.height_px, true}; }

  PlacedCell Seed(int row, int col) const { return TrueCell(photo_, board_, row, col); }

  BoardState GrownOver(const Frame& frame, const GrowthPolicy& policy, const GrowthSeeds& seeds) const {
    return GrownFrom(EmptyState(), frame, policy, seeds);
  }

  BoardState GrownFrom(BoardState state, const Frame& frame, const GrowthPolicy& policy,
                       const GrowthSeeds& seeds) const {
    const FrameFitter fitter(frame, photo_, board_);
    Grow(fitter.get(), options_, policy, seeds, &state);
    return state;
  }

  template <typename IsCovered>
  Frame Covered(const IsCovered& covered) const {
    return CoveredWhere(frame_, photo_, board_, covered);
  }

  void ExpectAtTruth(const BoardState& state) const {
    double squares = 0;
    for (const ViewCell& cell : state.cells()) {
      const double error_cells = ErrorCells(photo_, board_, cell);
      EXPECT_LT(error_cells, 0.3) << cell.row << " " << cell.col;
      squares += error_cells * error_cells;
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(state.cells().size())), 0.05);
  }

  // Cells whose surroundings are in the image.
  std::vector<PlacedCell> AllInSight() const { return TrueCells(photo_, board_, 1.6); }

  const Photograph photo_{.width_px = 220, .height_px = 200, .pitch_px = 7};
  const Board board_ = *GenerateBoard(kRows, kCols, 3, 5);
  const Frame frame_ = Render(photo_, board_);
  GrowthOptions options_;
};

TEST_F(Growths, FindAllCellsAtTruthFromOneSeed) {
  PlacedCell seed = Seed(kMiddle + 5, kMiddle - 6);
  seed.group = 7;
  const BoardState state = GrownOver(frame_, kFromSeeds, {{seed}, nullptr});
  ExpectAtTruth(state);
  const std::vector<PlacedCell> all = AllInSight();
  EXPECT_GT(all.size(), 600u);
  for (const PlacedCell& cell : all)
    EXPECT_GE(state.At(cell.row, cell.col), 0) << cell.row << " " << cell.col;
  for (const ViewCell& cell : state.cells()) EXPECT_EQ(cell.group, 7) << "follow from one seed";
  EXPECT_TRUE(
      std::is_sorted(state.cells().begin(), state.cells().end(), [](const ViewCell& a, const ViewCell& b) {
        return std::pair(a.row, a.col) < std::pair(b.row, b.col);
      }));
}

TEST_F(Growths, StartFromSeedsOnlyWhereThePolicySaysSo) {
  const GrowthSeeds seeds{{Seed(kMiddle, kMiddle)}, nullptr};
  GrowthPolicy policy = kFromSeeds;
  policy.from_seeds = false;
  EXPECT_TRUE(GrownOver(frame_, policy, seeds).cells().empty());
}

TEST_F(Growths, RememberWhatWasRead) {
  PlacedCell read = Seed(kMiddle, kMiddle);
  read.is_read = true;
  BoardState state = GrownOver(frame_, kFromSeeds, {{Seed(kMiddle + 3, kMiddle), read}, nullptr});
  ASSERT_GT(state.cells().size(), 100u);
  for (const ViewCell& cell : state.cells())
    EXPECT_EQ(cell.is_read, cell.row == kMiddle && cell.col == kMiddle) << cell.row << " " << cell.col;
  // At a boundary it is fitted again.
  state.Filter([&](size_t k) { return state.cells()[k].row >= kMiddle; });
  state = GrownFrom(state, frame_, kWithIsolated, {});
  EXPECT_TRUE(state.Find(kMiddle, kMiddle)->is_read);
}

TEST_F(Growths, IgnoreSeedsOffTheBoard) {
  const GrowthSeeds seeds{{{-1, 3, Seed(0, 3).pose}, {3, kCols, Seed(3, kCols - 1).pose}}, nullptr};
  EXPECT_TRUE(GrownOver(frame_, kFromSeeds, seeds).cells().empty());
}

TEST_F(Growths, StopAtACoverAndNoteEachCellThatTheyMiss) {
  constexpr double kRadius = 6;
  const auto distance = [](double u, double v) { return std::hypot(u - kMiddle, v - kMiddle); };
  const Frame frame = Covered([&](double u, double v) { return distance(u, v) < kRadius; });
  const BoardState state = GrownOver(frame, kFromSeeds, {{Seed(kMiddle, kMiddle + 9)}, nullptr});
  ExpectAtTruth(state);
  for (const ViewCell& cell : state.cells())
    EXPECT_GT(distance(cell.col + 0.5, cell.row + 0.5), kRadius - 0.5) << cell.row << " " << cell.col;
  for (const PlacedCell& cell : AllInSight()) {
    if (distance(cell.col + 0.5, cell.row + 0.5) < kRadius + 1.2) continue;
    EXPECT_GE(state.At(cell.row, cell.col), 0) << cell.row << " " << cell.col;
  }
  std::map<std::pair<int, int>, MissingCell> missing;
  for (const MissingCell& cell : state.Missing()) missing[{cell.row, cell.col}] = cell;
  int noted = 0;
  for (const ViewCell& cell : state.cells()) {
    for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
      const int row = cell.row + dr, col = cell.col + dc;
      if (state.At(row, col) >= 0 || distance(col + 0.5, row + 0.5) > kRadius + 1.2) continue;
      ASSERT_TRUE(missing.contains({row, col})) << row << " " << col;
      const MissingCell& miss = missing[{row, col}];
      EXPECT_NE(miss.why, WhyMissing::kTaken) << "nobody is there";
      const auto [x, y] = PixelFromBoard(photo_, board_, col + 0.5, row + 0.5);
      EXPECT_LT(std::hypot(miss.x_px - x, miss.y_px - y), 0.7 * photo_.pitch_px) << row << " " << col;
      ++noted;
    }
  }
  EXPECT_GT(noted, 20);
}

TEST_F(Growths, DoNotFollowAWrongSeed) {
  const FrameFitter fitter(frame_, photo_, board_);
  std::mt19937 random(8);
  size_t most = 0, sum = 0;
  constexpr int kSeeds = 200;
  for (int k = 0; k < kSeeds; ++k) {
    PlacedCell seed = Seed(kMiddle - 5 + k % 11, kMiddle - 5 + k / 11 % 11);
    // Each is of the right colour: the seed itself is not told by its ink.
    const CellColor color = board_.at(seed.row, seed.col);
    const int row = seed.row, col = seed.col;
    while (std::max(std::abs(seed.row - row), std::abs(seed.col - col)) < 3 ||
           board_.at(seed.row, seed.col) != color) {
      seed.row = static_cast<int>(random() % kRows);
      seed.col = static_cast<int>(random() % kCols);
    }
    BoardState state = EmptyState();
    Grow(fitter.get(), options_, kFromSeeds, {{seed}, nullptr}, &state);
    most = std::max(most, state.cells().size());
    sum += state.cells().size();
  }
  EXPECT_LT(most, 20u) << "of some 700 that are in sight";
  EXPECT_LT(sum, 2u * kSeeds);
}

TEST_F(Growths, LookAcrossCornersWhereThePolicySaysSo) {
  // Two quarters of the print are in sight; they touch at a corner.
  const Frame frame = Covered([](double u, double v) { return (u < kMiddle) != (v < kMiddle); });
  const GrowthSeeds seeds{{Seed(kMiddle - 5, kMiddle - 5)}, nullptr};
  GrowthPolicy policy = kFromSeeds;
  policy.from_diagonals = false;
  const auto beyond = [](const BoardState& state) {
    return std::count_if(state.cells().begin(), state.cells().end(),
                         [](const ViewCell& cell) { return cell.row >= kMiddle && cell.col >= kMiddle; });
  };
  EXPECT_EQ(beyond(GrownOver(frame, policy, seeds)), 0);
  policy.from_diagonals = true;
  const BoardState state = GrownOver(frame, policy, seeds);
  EXPECT_GT(beyond(state), 100);
  ExpectAtTruth(state);
}

TEST_F(Growths, FindACellThatOneOfItsNeighborsExpectsElsewhere) {
  BoardState state = EmptyState();
  ViewCell right{.row = kMiddle, .col = kMiddle - 1};
  right.fit.pose = Seed(right.row, right.col).pose;
  right.fit.explained = 0.7f;
  ViewCell wrong = right;
  wrong.row = kMiddle - 1;
  wrong.col = kMiddle;
  wrong.fit.pose = Seed(wrong.row, wrong.col).pose;
  wrong.fit.pose.x += static_cast<float>(photo_.pitch_px);  // as beyond a fold
  state.Add(right);
  state.Add(wrong);
  state = GrownFrom(state, frame_, GrowthPolicy(), {});
  const ViewCell* cell = state.Find(kMiddle, kMiddle);
  ASSERT_NE(cell, nullptr);
  EXPECT_LT(ErrorCells(photo_, board_, *cell), 0.1);
}

TEST_F(Growths, TakeAPositionOfTheImageOnce) {
  // Somebody has read 4 x 4 cells as others, which are out of the image.
  BoardState state = EmptyState();
  for (int k = 0; k < 16; ++k) {
    ViewCell wrong;
    wrong.row = k / 4;
    wrong.col = k % 4;
    wrong.fit.pose = Seed(kMiddle + k / 4, kMiddle + k % 4).pose;
    wrong.fit.explained = 0.5f;
    wrong.confidence = -1;
    state.Add(wrong);
  }
  const BoardState grown = GrownFrom(state, frame_, kFromSeeds, {{Seed(kMiddle + 8, kMiddle + 8)}, nullptr});
  std::map<std::pair<int, int>, WhyMissing> missing;
  for (const MissingCell& cell : grown.Missing()) missing[{cell.row, cell.col}] = cell.why;
  for (int k = 0; k < 16; ++k) {
    const std::pair<int, int> at{kMiddle + k / 4, kMiddle + k % 4};
    ASSERT_LT(grown.At(at.first, at.second), 0);
    const bool inside = k / 4 % 3 != 0 && k % 4 % 3 != 0;  // not looked for before those around are known
    EXPECT_TRUE(inside || missing[at] == WhyMissing::kTaken) << k;
  }
  for (const ViewCell& cell : grown.cells()) {
    for (const ViewCell& other : grown.cells()) {
      const float dx = other.fit.pose.x - cell.fit.pose.x, dy = other.fit.pose.y - cell.fit.pose.y;
      ASSERT_TRUE(&cell == &other || !cell.fit.pose.Contains(dx, dy)) << cell.row << " " << cell.col;
    }
  }

  // Once they are evicted, the same growth finds who was hidden by them.
  BoardState evicted = grown;
  evicted.Evict(0);
  const BoardState again = GrownFrom(evicted, frame_, GrowthPolicy(), {});
  ExpectAtTruth(again);
  for (int k = 0; k < 16; ++k) EXPECT_GE(again.At(kMiddle + k / 4, kMiddle + k % 4), 0) << k;
}

// The other colour that is nearest, so that the surroundings are explained all the same.
CellColor MostAlike(CellColor color) {
  const auto distance = [color](CellColor other) {
    int sum = 0;
    for (int c = 0; c < 3; ++c) sum += std::abs(CellColorRgb(color)[c] - CellColorRgb(other)[c]);
    return sum;
  };
  CellColor best = color == CellColor::kRed ? CellColor::kGreen : CellColor::kRed;
  for (int k = 0; k < kCellColors; ++k) {
    const auto other = static_cast<CellColor>(k);
    if (other != color && distance(other) < distance(best)) best = other;
  }
  return best;
}

TEST_F(Growths, TellThatAnotherInkIsThere) {
  Board misprinted = board_;
  CellColor& color = misprinted.cells[static_cast<size_t>(kMiddle) * kCols + kMiddle];
  color = MostAlike(color);
  const BoardState state =
      GrownOver(Render(photo_, misprinted), kFromSeeds, {{Seed(kMiddle + 5, kMiddle)}, nullptr});
  ExpectAtTruth(state);
  EXPECT_EQ(state.Around(kMiddle, kMiddle), 0b111101111u) << "all cells around it are found";
  ASSERT_LT(state.At(kMiddle, kMiddle), 0);
  const std::vector<MissingCell> missing = state.Missing();
  const auto here = std::find_if(missing.begin(), missing.end(), [](const MissingCell& cell) {
    return cell.row == kMiddle && cell.col == kMiddle;
  });
  ASSERT_NE(here, missing.end());
  EXPECT_EQ(here->why, WhyMissing::kOtherInk);
}

// A block of known cells, those at its border a quarter of a cell off.
class GrowthsFromABlock : public Growths {
 protected:
  static constexpr int kFirst = kMiddle - 4, kLast = kMiddle + 4;

  static bool AtBorder(const ViewCell& cell) {
    return std::min({cell.row - kFirst, cell.col - kFirst, kLast - cell.row, kLast - cell.col}) == 0;
  }

  BoardState Block() const {
    BoardState state = EmptyState();
    for (int row = kFirst; row <= kLast; ++row) {
      for (int col = kFirst; col <= kLast; ++col) {
        ViewCell cell;
        cell.row = row;
        cell.col = col;
        cell.fit.pose = Seed(row, col).pose;
        cell.fit.explained = 0.7f;
        cell.confidence = 0.5f;
        if (AtBorder(cell)) cell.fit.pose.x += 0.25f * static_cast<float>(photo_.pitch_px);
        state.Add(cell);
      }
    }
    return state;
  }
};

TEST_F(GrowthsFromABlock, LeaveKnownCellsAsTheyAre) {
  const BoardState block = Block(), grown = GrownFrom(block, frame_, GrowthPolicy(), {});
  EXPECT_GT(grown.cells().size(), 2 * block.cells().size());
  for (const ViewCell& cell : block.cells()) {
    const ViewCell* after = grown.Find(cell.row, cell.col);
    ASSERT_NE(after, nullptr);
    EXPECT_TRUE(SamePose(after->fit.pose, cell.fit.pose)) << cell.row << " " << cell.col;
    EXPECT_EQ(after->confidence, cell.confidence);
  }
}

TEST_F(GrowthsFromABlock, StartNearChangesAloneWhereThePolicySaysSo) {
  BoardState block = Block();
  block.MarkScored();
  EXPECT_EQ(GrownFrom(block, frame_, kNearChanges, {}).cells().size(), block.cells().size());
  const int corner = block.At(kLast, kLast);
  block.Filter([corner](size_t k) { return static_cast<int>(k) != corner; });
  const BoardState grown = GrownFrom(block, frame_, kNearChanges, {});
  EXPECT_GE(grown.cells().size(), GrownFrom(block, frame_, {.in_one_step = true}, {}).cells().size())
      << "all that can be seen follows from there";
}

TEST_F(GrowthsFromABlock, RefitTheBoundaryWhereThePolicySaysSo) {
  const BoardState block = Block();
  const BoardState grown = GrownFrom(block, frame_, {.refits_boundary = true}, {});
  for (const ViewCell& cell : block.cells()) {
    const ViewCell* after = grown.Find(cell.row, cell.col);
    ASSERT_NE(after, nullptr);
    if (AtBorder(cell)) {
      EXPECT_LT(ErrorCells(photo_, board_, *after), 0.1) << cell.row << " " << cell.col;
    } else {
      EXPECT_TRUE(SamePose(after->fit.pose, cell.fit.pose)) << cell.row << " " << cell.col;
    }
  }
}

TEST_F(GrowthsFromABlock, RefitMovesNoCellOntoACover) {
  const Frame frame = Covered([](double u, double) { return u > kLast; });
  const BoardState refitted = GrownFrom(Block(), frame, {.refits_boundary = true}, {});
  const BoardState kept = GrownFrom(Block(), frame, GrowthPolicy(), {});
  EXPECT_GE(kept.At(kMiddle, kLast), 0);
  EXPECT_LT(refitted.At(kMiddle, kLast), 0) << "the image shows none";
}

TEST_F(GrowthsFromABlock, FindWhoWasHiddenByAnEvictedCell) {
  // The middle of the block is missing: somebody has read it as another cell.
  BoardState state = Block();
  const CellPose pose = state.Find(kMiddle, kMiddle)->fit.pose;
  state.Filter([&](size_t k) { return static_cast<int>(k) != state.At(kMiddle, kMiddle); });
  ViewCell wrong;
  wrong.fit.pose = pose;
  wrong.confidence = -1;
  state.Add(wrong);
  state = GrownFrom(state, frame_, GrowthPolicy(), {});
  ASSERT_LT(state.At(kMiddle, kMiddle), 0);
  state.Evict(0);
  state = GrownFrom(state, frame_, GrowthPolicy(), {});
  ASSERT_GE(state.At(kMiddle, kMiddle), 0) << "with the neighbours that were known before";
  EXPECT_LT(ErrorCells(photo_, board_, *state.Find(kMiddle, kMiddle)), 0.1);
}

// The print is hidden by a strip that growth cannot cross.
class GrowthsBesideAStrip : public Growths {
 protected:
  static constexpr int kFirst = kMiddle, kEnd = kMiddle + 4;

  const Frame strip_ = Covered([](double u, double) { return u >= kFirst && u < kEnd; });
  const PlacedCell seed_ = Seed(kMiddle, kFirst - 5), beyond_ = Seed(kMiddle, kEnd + 5);

  static size_t Beyond(const BoardState& state) {
    return std::count_if(state.cells().begin(), state.cells().end(),
                         [](const ViewCell& cell) { return cell.col > kFirst; });
  }
};

TEST_F(GrowthsBesideAStrip, AskForIsolatedSeedsOnceAllThatIsClearIsTaken) {
  int asked = 0;
  size_t known = 0;
  const auto isolated = [&](const BoardState& state) {
    ++asked;
    known = state.cells().size();
    EXPECT_EQ(Beyond(state), 0u);
    return std::vector<PlacedCell>{beyond_};
  };
  GrowthPolicy policy = kFromSeeds;
  const BoardState without = GrownOver(strip_, policy, {{seed_}, isolated});
  EXPECT_EQ(asked, 0);
  EXPECT_EQ(Beyond(without), 0u);
  policy.with_isolated = true;
  const BoardState with = GrownOver(strip_, policy, {{seed_}, isolated});
  EXPECT_EQ(asked, 1);
  EXPECT_GT(known, without.cells().size() * 8 / 10) << "nearly all of this print is clear";
  EXPECT_GT(Beyond(with), 150u);
  ExpectAtTruth(with);
}

TEST(GrowthOptionsTest, AreChecked) {
  GrowthOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.clearly_explained = 1.1f;
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("growth.clearly_explained"));
  options = {.min_known_at_boundary = 9};
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("growth.min_known_at_boundary"));
  options = {.fit = {.iterations = 0}};
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("growth.fit.iterations"));
}

}  // namespace
}  // namespace weft
