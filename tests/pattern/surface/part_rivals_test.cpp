#include "pattern/surface/part_rivals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "pattern/board/joint_board.h"
#include "pattern/fit/appearance.h"
#include "pattern/image/color_image.h"
#include "tests/pattern/board/boards_apart.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

// A photograph of a skirt's rows 0 to 14 and, below them, the last 15 rows of a shirt, as if the skirt hung
// over it.
class PartRivals : public ::testing::Test {
 protected:
  static constexpr int kSkirtRows = 30, kShirtRows = 15, kCols = 90, kEdge = 15;

  void SetUp() override {
    photo_.width_px = 640;
    photo_.angle_deg = 4;
    const Board skirt = BoardApartFrom({}, kSkirtRows, kCols, 1);
    const Board shirt = BoardApartFrom({skirt}, kShirtRows, kCols, 2);
    joint_ = *JoinBoards({skirt, shirt});
    shown_.rows = kEdge + kShirtRows;
    shown_.cols = kCols;
    for (int row = 0; row < shown_.rows; ++row)
      for (int col = 0; col < kCols; ++col)
        shown_.cells.push_back(row < kEdge ? skirt.at(row, col) : shirt.at(row - kEdge, col));
    pyramid_.push_back(*ToColorImage(Render(photo_, shown_)));
  }

  // Of the row below the skirt's shown ones.
  static int ShirtRow(int shown_row) { return shown_row - kEdge + kSkirtRows + kRowsBetweenParts; }

  CellPose PoseAt(int row, int col) const {
    const auto at = [&](double u, double v) { return PixelFromBoard(photo_, shown_, u, v); };
    const auto [x, y] = at(col + 0.5, row + 0.5);
    const auto [xa, ya] = at(col + 1.5, row + 0.5);
    const auto [xb, yb] = at(col + 0.5, row + 1.5);
    const auto f = [](double value) { return static_cast<float>(value); };
    return {f(x), f(y), f(xa - x), f(ya - y), f(xb - x), f(yb - y)};
  }

  // A cell of the joint board that is believed to be at a shown place, with what its print explains there.
  void Believe(const CellFitter& fitter, int row, int shown_row, int col, BoardState* state) const {
    PredictedCell cell{.row = row, .col = col, .pose = PoseAt(shown_row, col)};
    for (int n = 0; n < 9; ++n) cell.in_sight[n] = n < 6 ? 1.0f : 0.0f;
    ViewCell known{row, col, fitter.Fit(cell, {.iterations = 1, .min_explained = -1e9f}), 0, 0, 1};
    known.fit.pose = cell.pose;
    state->Add(known);
  }

  // The cells that stay, of those beyond the skirt's edge, where all of the shirt but its row kEdge is known.
  template <typename Cells>
  int StayOf(const Cells& believed_beyond_edge, bool shirt_is_known) const {
    const SampledProfile profile(joint_.square_fraction);
    std::vector<PlacedCell> placed;
    for (int row = 4; row < kEdge; ++row)
      for (int col = 5; col < kCols - 5; ++col) placed.push_back({row, col, PoseAt(row, col)});
    Appearance typical;
    for (int k = 0; k < kCellColors; ++k)
      for (int c = 0; c < 3; ++c)
        typical.inks[k][c] = 64 + 0.5f * static_cast<float>(CellColorRgb(static_cast<CellColor>(k))[c]);
    typical.black.fill(25);
    const CellFitter fitter(
        pyramid_, joint_, profile,
        CalibrateAppearance({pyramid_, joint_, profile}, placed, {0.6f, 0.8f, 1.0f}, typical));
    BoardState state(joint_, photo_.width_px, photo_.height_px);
    for (const PlacedCell& cell : placed) Believe(fitter, cell.row, cell.row, cell.col, &state);
    if (shirt_is_known)
      for (int row = kEdge + 1; row < kEdge + 6; ++row)
        for (int col = 5; col < kCols - 5; ++col) Believe(fitter, ShirtRow(row), row, col, &state);
    const size_t sure = state.cells().size();
    for (const int col : believed_beyond_edge) Believe(fitter, kEdge, kEdge, col, &state);
    const int gone = EvictPartRivals(fitter, &state);
    for (const PlacedCell& cell : placed) EXPECT_NE(state.Find(cell.row, cell.col), nullptr);
    EXPECT_EQ(state.cells().size() + gone, sure + believed_beyond_edge.size());
    return static_cast<int>(state.cells().size() - sure);
  }

  // Columns where the skirt's row beyond the edge has the ink of the shirt's cell: those that are mistaken
  // for it.
  std::vector<int> Alike() const {
    std::vector<int> cols;
    for (int col = 6; col < kCols - 6; ++col)
      if (joint_.at(kEdge, col) == joint_.at(ShirtRow(kEdge), col)) cols.push_back(col);
    return cols;
  }

  Photograph photo_;
  Board joint_, shown_;
  std::vector<ColorImage> pyramid_;
};

TEST_F(PartRivals, TheGarmentThatGoesOnKeepsItsPlace) {
  ASSERT_GT(Alike().size(), 2u);
  EXPECT_EQ(StayOf(Alike(), true), 0);
}

TEST_F(PartRivals, WithoutTheOtherGarmentThereIsNoRival) {
  EXPECT_EQ(StayOf(Alike(), false), static_cast<int>(Alike().size()));
}

// Its cells are printed there, so no rival explains the image better.
TEST_F(PartRivals, ARowThatIsThereStays) {
  std::vector<int> all;
  for (int col = 6; col < kCols - 6; ++col) all.push_back(col);
  shown_ = joint_;
  shown_.parts.clear();
  pyramid_ = {*ToColorImage(Render(photo_, shown_))};
  EXPECT_EQ(StayOf(all, false), static_cast<int>(all.size()));
}

}  // namespace
}  // namespace weft
