#include "pattern/surface/predicted_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "pattern/fit/appearance.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

// A photograph of a board, of which the cells in rows 20 to 29 and columns 20 to 29 are asked for.
class PredictedCells : public ::testing::Test {
 protected:
  static constexpr int kFirst = 20, kLast = 29;

  void SetUp() override {
    board_ = *GenerateBoard(50, 50, 3, 5);
    frame_ = Render(photo_, board_);
    for (int row = 12; row < 38; ++row) {
      for (int col = 12; col < 38; ++col) {
        if (row >= kFirst && row <= kLast && col >= kFirst && col <= kLast) {
          wanted_.push_back(Truth(row, col));
        } else {
          known_.push_back(Truth(row, col));
        }
      }
    }
  }

  PredictedCell Truth(int row, int col) const {
    PredictedCell cell{.row = row, .col = col, .pose = {}, .in_sight = {}, .sigma_px = 0.1f};
    const auto [x, y] = PixelFromBoard(photo_, board_, col + 0.5, row + 0.5);
    const auto [xa, ya] = PixelFromBoard(photo_, board_, col + 1.5, row + 0.5);
    const auto [xb, yb] = PixelFromBoard(photo_, board_, col + 0.5, row + 1.5);
    const auto [xc, yc] = PixelFromBoard(photo_, board_, col - 0.5, row + 0.5);
    const auto [xd, yd] = PixelFromBoard(photo_, board_, col + 0.5, row - 0.5);
    const auto f = [](double value) { return static_cast<float>(value); };
    cell.pose = {f(x), f(y), f(xa - xc) / 2, f(ya - yc) / 2, f(xb - xd) / 2, f(yb - yd) / 2};
    cell.in_sight.fill(1);
    return cell;
  }

  // Grey over all asked cells but those of rows and columns [first, end).
  void Cover(int first, int end) {
    auto bytes = std::make_shared<std::vector<uint8_t>>(*frame_.pixels);
    for (int y = 0; y < photo_.height_px; ++y) {
      for (int x = 0; x < photo_.width_px; ++x) {
        const auto [u, v] = BoardFromPixel(photo_, board_, x, y);
        const bool asked = u >= kFirst && u <= kLast + 1 && v >= kFirst && v <= kLast + 1;
        const bool shown = u >= first && u < end && v >= first && v < end;
        if (!asked || shown) continue;
        for (int c = 0; c < 3; ++c) {
          (*bytes)[3 * (static_cast<size_t>(y) * photo_.width_px + x) + c] =
              static_cast<uint8_t>(120 + (x + y) % 7);
        }
      }
    }
    frame_.pixels = std::move(bytes);
    for (PredictedCell& cell : wanted_) {
      for (int k = 0; k < 9; ++k) {
        const int row = cell.row + k / 3 - 1, col = cell.col + k % 3 - 1;
        const bool shown = row >= first && row < end && col >= first && col < end;
        const bool asked = row >= kFirst && row <= kLast && col >= kFirst && col <= kLast;
        cell.in_sight[k] = shown || !asked ? 1.0f : 0.0f;
      }
    }
  }

  // What was found of the wanted cells, in a view where the known ones are known.
  struct Found {
    std::vector<std::optional<WhyMissing>> missing;  // [wanted]
    std::vector<ViewCell> cells;
  };

  Found Find() const {
    std::vector<ColorImage> pyramid;
    pyramid.push_back(*ToColorImage(frame_));
    const SampledProfile profile(board_.square_fraction);
    std::vector<PlacedCell> placed;
    BoardState state(board_, frame_.width_px, frame_.height_px);
    for (const PredictedCell& cell : known_) {
      placed.push_back({cell.row, cell.col, cell.pose});
      ViewCell known{cell.row, cell.col, {}, 0, 0, 1};
      known.fit.pose = cell.pose;
      state.Add(known);
    }
    const Appearance appearance =
        CalibrateAppearance({pyramid, board_, profile}, placed, {0.6f, 0.8f, 1.0f}, Typical());
    const CellFitter fitter(pyramid, board_, profile, appearance);
    Found found{.missing = FindPredicted(fitter, wanted_, options_, &state), .cells = {}};
    for (const PredictedCell& cell : wanted_) {
      if (const ViewCell* at = state.Find(cell.row, cell.col)) found.cells.push_back(*at);
    }
    EXPECT_EQ(state.cells().size(), known_.size() + found.cells.size());
    return found;
  }

  static Appearance Typical() {
    Appearance start;
    for (int k = 0; k < kCellColors; ++k) {
      const auto rgb = CellColorRgb(static_cast<CellColor>(k));
      for (int c = 0; c < 3; ++c) start.inks[k][c] = 64 + 0.5f * static_cast<float>(rgb[c]);
    }
    start.black.fill(25);
    return start;
  }

  // Wanted cells found; each must lie where it is.
  int CountFound(const Found& found) const {
    for (const ViewCell& cell : found.cells) {
      const CellPose truth = Truth(cell.row, cell.col).pose, &at = cell.fit.pose;
      EXPECT_LT(std::hypot(at.x - truth.x, at.y - truth.y), 0.5) << cell.row << " " << cell.col;
    }
    return static_cast<int>(found.cells.size());
  }

  Photograph photo_;
  Board board_;
  Frame frame_;
  std::vector<PredictedCell> known_, wanted_;
  GuidedOptions options_;
};

TEST_F(PredictedCells, AreFoundWhereTheyArePredictedAndKnowTheirErrors) {
  const Found found = Find();
  EXPECT_GE(CountFound(found), 98);
  double square = 0;
  for (const ViewCell& cell : found.cells) {
    const CellPose truth = Truth(cell.row, cell.col).pose;
    const float sigma_px = kSigmaFactor * cell.fit.sigma_px;
    square += (std::pow(cell.fit.pose.x - truth.x, 2) + std::pow(cell.fit.pose.y - truth.y, 2)) /
              (sigma_px * sigma_px);
  }
  const double per_degree = square / (2.0 * static_cast<double>(found.cells.size()));
  EXPECT_GT(per_degree, 0.3);
  EXPECT_LT(per_degree, 2) << "sigma_px is true";
}

TEST_F(PredictedCells, FindsAPieceOfFourCells) {
  Cover(24, 26);
  EXPECT_EQ(CountFound(Find()), 4);
}

TEST_F(PredictedCells, FindsACellThatIsAlone) {
  Cover(24, 25);
  const Found found = Find();
  EXPECT_EQ(CountFound(found), 1);
}

TEST_F(PredictedCells, FindsNothingWhereTheClothIsCovered) {
  Cover(0, 0);
  EXPECT_EQ(CountFound(Find()), 0);
  for (PredictedCell& cell : wanted_) cell.in_sight.fill(1);  // as if nobody knew
  EXPECT_EQ(CountFound(Find()), 0);
}

TEST_F(PredictedCells, RefusesPredictionsThatAreACellOff) {
  for (const auto& [dx, dy] : {std::pair{1.0f, 0.0f}, {0.0f, -1.0f}, {2.0f, 1.0f}}) {
    for (PredictedCell& cell : wanted_) {
      cell = Truth(cell.row, cell.col);
      cell.pose.x += dx * cell.pose.ax + dy * cell.pose.bx;
      cell.pose.y += dx * cell.pose.ay + dy * cell.pose.by;
    }
    for (const float sigma_px : {0.1f, 3.0f}) {
      for (PredictedCell& cell : wanted_) cell.sigma_px = sigma_px;
      const Found found = Find();
      EXPECT_TRUE(found.cells.empty())
          << found.cells.size() << " found, off by " << dx << " " << dy << " sigma " << sigma_px;
    }
  }
}

TEST_F(PredictedCells, KnownCellsKeepTheirPositions) {
  // Somebody has read the wanted cells before, as others.
  for (const PredictedCell& cell : wanted_) {
    known_.push_back(cell);
    known_.back().row += 20;
  }
  const Found found = Find();
  EXPECT_TRUE(found.cells.empty());
  for (const auto& why : found.missing) EXPECT_THAT(why, AnyOf(WhyMissing::kTaken, WhyMissing::kNoFit));
}

// A start a whole cell off converges on a neighbour's print, if on anything: the best of several starts
// counts.
TEST_F(PredictedCells, TheBestOfSeveralStartsIsKept) {
  for (PredictedCell& cell : wanted_) {
    cell.pose.x += 0.5f * cell.pose.ax;
    cell.sigma_px = 2.5f;
  }
  options_.max_move_cells = 1;
  EXPECT_GE(CountFound(Find()), 90);
}

TEST_F(PredictedCells, OptionsAreChecked) {
  options_.min_lead = 2;
  EXPECT_THAT(std::string(options_.Validate().message()), HasSubstr("guided.min_lead"));
}

}  // namespace
}  // namespace weft
