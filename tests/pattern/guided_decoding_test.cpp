#include "pattern/guided_decoding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

// A photograph of a board, of which the cells in rows 20 to 29 and columns 20 to 29 are asked for.
class GuidedDecoding : public ::testing::Test {
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
    PredictedCell cell{.row = row, .col = col, .frame = {}, .in_sight = {}, .sigma_px = 0.1f};
    const auto [x, y] = PixelFromBoard(photo_, board_, col + 0.5, row + 0.5);
    const auto [xa, ya] = PixelFromBoard(photo_, board_, col + 1.5, row + 0.5);
    const auto [xb, yb] = PixelFromBoard(photo_, board_, col + 0.5, row + 1.5);
    const auto [xc, yc] = PixelFromBoard(photo_, board_, col - 0.5, row + 0.5);
    const auto [xd, yd] = PixelFromBoard(photo_, board_, col + 0.5, row - 0.5);
    const auto f = [](double value) { return static_cast<float>(value); };
    cell.frame = {f(x), f(y), f(xa - xc) / 2, f(ya - yc) / 2, f(xb - xd) / 2, f(yb - yd) / 2};
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

  GuidedResult Decode() const {
    absl::StatusOr<GuidedResult> result = DecodePredicted(frame_, board_, known_, wanted_, options_);
    EXPECT_TRUE(result.ok()) << result.status();
    return *std::move(result);
  }

  // Wanted cells found; each must lie where it is.
  int CountFound(const GuidedResult& result) const {
    int found = 0;
    for (size_t k = 0; k < wanted_.size(); ++k) {
      if (result.cells[k].verdict != GuidedVerdict::kFound) continue;
      ++found;
      const CellFrame truth = Truth(wanted_[k].row, wanted_[k].col).frame, &at = result.cells[k].fit.frame;
      EXPECT_LT(std::hypot(at.x - truth.x, at.y - truth.y), 0.5) << wanted_[k].row << " " << wanted_[k].col;
    }
    return found;
  }

  Photograph photo_;
  Board board_;
  Frame frame_;
  std::vector<PredictedCell> known_, wanted_;
  GuidedOptions options_;
};

TEST_F(GuidedDecoding, FindsCellsAndTheirCornersWhereTheyArePredicted) {
  const GuidedResult result = Decode();
  EXPECT_GE(CountFound(result), 98);
  double square = 0, centers = 0, corners = 0;
  for (const Observation& o : result.observations) {
    if (o.node.kind == NodeKind::kCorner) {
      const auto [x, y] = PixelFromBoard(photo_, board_, o.node.col, o.node.row);
      EXPECT_LT(std::hypot(o.x_px - x, o.y_px - y), 0.4);
      ++corners;
    } else {
      const auto [x, y] = PixelFromBoard(photo_, board_, o.node.col + 0.5, o.node.row + 0.5);
      square += (std::pow(o.x_px - x, 2) + std::pow(o.y_px - y, 2)) / (o.sigma_px * o.sigma_px);
      ++centers;
    }
  }
  EXPECT_GE(corners, 110) << "11 x 11 corners touch the cells";
  const double per_degree = square / (2 * centers);
  EXPECT_GT(per_degree, 0.3);
  EXPECT_LT(per_degree, 2) << "sigma_px is true";
}

TEST_F(GuidedDecoding, FindsAPieceOfFourCells) {
  Cover(24, 26);
  EXPECT_EQ(CountFound(Decode()), 4);
}

TEST_F(GuidedDecoding, FindsACellThatIsAlone) {
  Cover(24, 25);
  const GuidedResult result = Decode();
  EXPECT_EQ(CountFound(result), 1);
}

TEST_F(GuidedDecoding, FindsNothingWhereTheClothIsCovered) {
  Cover(0, 0);
  EXPECT_EQ(CountFound(Decode()), 0);
  for (PredictedCell& cell : wanted_) cell.in_sight.fill(1);  // as if nobody knew
  EXPECT_EQ(CountFound(Decode()), 0);
}

TEST_F(GuidedDecoding, RefusesPredictionsThatAreACellOff) {
  for (const auto& [dx, dy] : {std::pair{1.0f, 0.0f}, {0.0f, -1.0f}, {2.0f, 1.0f}}) {
    for (PredictedCell& cell : wanted_) {
      cell = Truth(cell.row, cell.col);
      cell.frame.x += dx * cell.frame.ax + dy * cell.frame.bx;
      cell.frame.y += dx * cell.frame.ay + dy * cell.frame.by;
    }
    for (const float sigma_px : {0.1f, 3.0f}) {
      for (PredictedCell& cell : wanted_) cell.sigma_px = sigma_px;
      const GuidedResult result = Decode();
      EXPECT_TRUE(result.observations.empty())
          << result.observations.size() << " found, off by " << dx << " " << dy << " sigma " << sigma_px;
    }
  }
}

TEST_F(GuidedDecoding, KnownCellsKeepTheirPlaces) {
  // Somebody has read the wanted cells before, as others.
  for (const PredictedCell& cell : wanted_) {
    known_.push_back(cell);
    known_.back().row += 20;
  }
  const GuidedResult result = Decode();
  EXPECT_TRUE(result.observations.empty());
  for (const GuidedCell& cell : result.cells) {
    EXPECT_THAT(cell.verdict, AnyOf(GuidedVerdict::kTaken, GuidedVerdict::kNoFit));
  }
}

TEST_F(GuidedDecoding, LooksForNothingInAViewOfFewCells) {
  known_.resize(19);
  EXPECT_TRUE(Decode().observations.empty());
}

TEST_F(GuidedDecoding, RefusesGreyImagesAndBadOptions) {
  frame_.format = PixelFormat::kGrey8;
  auto bytes = std::make_shared<std::vector<uint8_t>>(frame_.pixels->size() / 3, uint8_t{90});
  frame_.pixels = bytes;
  EXPECT_THAT(std::string(DecodePredicted(frame_, board_, known_, wanted_, options_).status().message()),
              HasSubstr("grey"));
  options_.min_lead = 2;
  EXPECT_THAT(std::string(DecodePredicted(frame_, board_, known_, wanted_, options_).status().message()),
              HasSubstr("guided.min_lead"));
}

}  // namespace
}  // namespace weft
