// Growth where one part of the print is in front of another.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "pattern/surface/growth.h"
#include "tests/pattern/surface/rendered_surface.h"

namespace weft {
namespace {

constexpr int kWidthPx = 220, kHeightPx = 180;
constexpr int kLongRows = 60, kLongCols = 120;
// The first column and the columns of the part in front, and one that is left of all behind.
constexpr int kFront = 23, kFrontCols = 7, kBehind = 41;

// Two photographs of one board: the middle of the board, and its left part in front of that.
class OccludedGrowths : public testing::Test {
 protected:
  // The left side of a wide image shows columns that are far left of the middle.
  Frame OneInFrontOfTheOther() const {
    Frame frame = Render(behind_, board_);
    const Frame front = Render(front_, board_);
    auto bytes = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
    for (int y = 0; y < kHeightPx; ++y) {
      for (int x = 0; x < kWidthPx; ++x) {
        if (!IsFront(x, y)) continue;
        const uint8_t* from = &(*front.pixels)[3 * (static_cast<size_t>(y) * front_.width_px + x)];
        std::copy_n(from, 3, &(*bytes)[3 * (static_cast<size_t>(y) * kWidthPx + x)]);
      }
    }
    frame.pixels = std::move(bytes);
    return frame;
  }

  bool IsFront(double x, double y) const {
    const auto [u, v] = BoardFromPixel(front_, board_, x, y);
    return Printed(front_, board_, static_cast<int>(std::floor(v)), static_cast<int>(std::floor(u)));
  }

  // Share of a cell behind that can be seen.
  double Visible(int row, int col) const {
    constexpr int kSide = 8;
    const CellPose pose = TrueFrame(behind_, board_, row, col);
    int visible = 0;
    for (int k = 0; k < kSide * kSide; ++k) {
      const double u = (k % kSide + 0.5) / kSide - 0.5, v = (k / kSide + 0.5) / kSide - 0.5;
      visible += !IsFront(pose.x + u * pose.ax + v * pose.bx, pose.y + u * pose.ay + v * pose.by);
    }
    return static_cast<double>(visible) / (kSide * kSide);
  }

  // What follows from a seed on each part, and on both sides of the one in front.
  BoardState InTheOpen() const {
    BoardState state(board_, kWidthPx, kHeightPx, true);
    const auto behind = TrueCells(behind_, board_, 2);
    const auto [left, right] =
        std::minmax_element(behind.begin(), behind.end(),
                            [](const PlacedCell& a, const PlacedCell& b) { return a.pose.x < b.pose.x; });
    std::vector<PlacedCell> seeds = {*left, *right};
    for (int row = 0; row < kLongRows && seeds.size() < 3; ++row) {
      const PlacedCell cell = TrueCell(front_, board_, row, kFront + kFrontCols / 2);
      if (cell.pose.y > 60 && cell.pose.y < 120) seeds.push_back(cell);
    }
    EXPECT_EQ(seeds.size(), 3u);
    Grow(fitter_.get(), options_, kFromSeeds, {seeds, nullptr}, &state);
    return state;
  }

  BoardState GrownFurther(BoardState state, const GrowthPolicy& policy) const {
    Grow(fitter_.get(), options_, policy, {}, &state);
    return state;
  }

  // All cells are where they are, and none that is hidden is found.
  void ExpectAtTruth(const BoardState& state) const {
    for (const ViewCell& cell : state.cells()) {
      const bool is_behind = cell.col >= kBehind;
      EXPECT_LT(ErrorCells(is_behind ? behind_ : front_, board_, cell), 0.3) << cell.row << " " << cell.col;
      EXPECT_TRUE(!is_behind || Visible(cell.row, cell.col) > 0.25) << cell.row << " " << cell.col;
    }
  }

  const Photograph behind_{
      .width_px = kWidthPx, .height_px = kHeightPx, .pitch_px = 7, .angle_deg = 12, .bend_cells = 0.3};
  const Photograph front_{.width_px = 756,
                          .height_px = kHeightPx,
                          .pitch_px = 7,
                          .angle_deg = -8,
                          .bend_cells = 0.3,
                          .row = 0,
                          .col = kFront,
                          .cols = kFrontCols,
                          .seed = 2};
  const Board board_ = *GenerateBoard(kLongRows, kLongCols, 3, 5);
  const FrameFitter fitter_{OneInFrontOfTheOther(), behind_, board_};
  // What covers a cell counts against a fit that knows nothing of it.
  GrowthOptions options_{.fit = {.min_explained = 0.8f}};
};

TEST_F(OccludedGrowths, TakeCellsAtTheEdgeWhereThePolicySaysSo) {
  const BoardState open = InTheOpen();
  const BoardState plain = GrownFurther(open, GrowthPolicy()), behind = GrownFurther(open, kBehindOccluders);
  ExpectAtTruth(plain);
  ExpectAtTruth(behind);
  EXPECT_GE(behind.cells().size(), plain.cells().size() + 10);
  // At a straight edge no missing cell has eight known ones around it.
  options_.min_known_at_boundary = 8;
  EXPECT_EQ(GrownFurther(open, kBehindOccluders).cells().size(), open.cells().size());
}

TEST_F(OccludedGrowths, LookForNoCellThatIsHidden) {
  const BoardState behind = GrownFurther(InTheOpen(), kBehindOccluders);
  std::map<std::pair<int, int>, WhyMissing> missing;
  for (const MissingCell& cell : behind.Missing()) missing[{cell.row, cell.col}] = cell.why;
  int hidden = 0;
  for (int row = 1; row < kLongRows - 1; ++row) {
    for (int col = kBehind; col < kLongCols - 1; ++col) {
      const int known = std::popcount(behind.Around(row, col));
      if (known < options_.min_known_at_boundary || Visible(row, col) > 0.2) continue;
      EXPECT_EQ(missing.at({row, col}), WhyMissing::kTaken) << row << " " << col;
      ++hidden;
    }
  }
  EXPECT_GT(hidden, 0);
}

}  // namespace
}  // namespace weft
