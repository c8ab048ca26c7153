#include "pattern/view_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// A photograph in which the first pass may not take the cells of a square: its image is grey there at first.
class ViewDecoders : public testing::Test {
 protected:
  static constexpr int kFirst = 22, kLast = 27;

  ViewDecoders() : open_(Render(photo_, board_.board())), covered_(open_) {
    auto bytes = std::make_shared<std::vector<uint8_t>>(*open_.pixels);
    for (int y = 0; y < photo_.height_px; ++y) {
      for (int x = 0; x < photo_.width_px; ++x) {
        const auto [u, v] = BoardFromPixel(photo_, board_.board(), x, y);
        if (u < kFirst || u > kLast + 1 || v < kFirst || v > kLast + 1) continue;
        std::fill_n(bytes->begin() + 3 * (static_cast<size_t>(y) * photo_.width_px + x), 3, uint8_t{120});
      }
    }
    covered_.pixels = bytes;
    for (int row = kFirst; row <= kLast; ++row) {
      for (int col = kFirst; col <= kLast; ++col) predicted_.push_back(Truth(row, col));
    }
  }

  PredictedCell Truth(int row, int col) const {
    const auto at = [&](double u, double v) { return PixelFromBoard(photo_, board_.board(), u, v); };
    const auto f = [](double value) { return static_cast<float>(value); };
    const auto [x, y] = at(col + 0.5, row + 0.5);
    const auto [right_x, right_y] = at(col + 1, row + 0.5);
    const auto [left_x, left_y] = at(col, row + 0.5);
    const auto [down_x, down_y] = at(col + 0.5, row + 1);
    const auto [up_x, up_y] = at(col + 0.5, row);
    PredictedCell cell{.row = row, .col = col, .sigma_px = 0.1f};
    cell.pose = {f(x), f(y), f(right_x - left_x), f(right_y - left_y), f(down_x - up_x), f(down_y - up_y)};
    cell.in_sight.fill(1);
    return cell;
  }

  // Decoded from the covered image, of which nothing is left.
  std::unique_ptr<ViewDecoder> FirstPass() const {
    auto view = *ViewDecoder::Read(covered_, board_, {});
    view->Decode();
    view->Rest(false);
    view->Wake();
    return view;
  }

  const Photograph photo_;
  const BoardIndex board_ = *BoardIndex::Build(*GenerateBoard(50, 50, 3, 5));
  const Frame open_;
  Frame covered_;
  std::vector<PredictedCell> predicted_;
};

TEST_F(ViewDecoders, BothPassesMakeOneSetOfObservations) {
  const auto view = FirstPass();
  for (const PredictedCell& cell : predicted_) ASSERT_LT(view->state().At(cell.row, cell.col), 0);
  const size_t first = view->Observations().size();
  ASSERT_TRUE(view->ReadAgain(open_).ok());
  const auto missing = view->Find(predicted_, {});
  ASSERT_TRUE(missing.ok()) << missing.status();
  EXPECT_GE(std::ranges::count_if(*missing, [](const auto& why) { return !why.has_value(); }), 34);

  const std::vector<Observation> all = view->Observations();
  EXPECT_GT(all.size(), first + 60) << "centres, and the corners between them";
  EXPECT_TRUE(std::ranges::is_sorted(
      all, {}, [](const Observation& o) { return std::tuple(o.node.kind, o.node.row, o.node.col); }));
  std::map<std::pair<int, int>, const Observation*> centers;
  for (const Observation& o : all) {
    if (o.node.kind == NodeKind::kCenter) {
      EXPECT_TRUE(centers.emplace(std::pair{o.node.row, o.node.col}, &o).second) << "a node occurs once";
    }
  }
  // A corner is the mean of the four centres around it, whichever pass found them: triangulation relies on
  // it.
  for (const Observation& o : all) {
    if (o.node.kind != NodeKind::kCorner) continue;
    double x = 0, y = 0;
    for (int k = 0; k < 4; ++k) {
      const auto at = centers.find({o.node.row - 1 + k / 2, o.node.col - 1 + k % 2});
      ASSERT_NE(at, centers.end());
      x += 0.25 * at->second->x_px;
      y += 0.25 * at->second->y_px;
    }
    EXPECT_NEAR(o.x_px, x, 1e-4);
    EXPECT_NEAR(o.y_px, y, 1e-4);
  }
}

TEST_F(ViewDecoders, GrowFromWhatTheSecondPassFinds) {
  const auto view = FirstPass();
  std::map<std::pair<int, int>, float> sure;
  for (const ViewCell& cell : view->state().cells()) sure[{cell.row, cell.col}] = cell.confidence;
  const std::vector<PredictedCell> one = {Truth(kFirst + 2, kFirst + 3)};
  ASSERT_TRUE(view->ReadAgain(covered_).ok());
  ASSERT_TRUE(view->Find(one, {}).ok());
  EXPECT_EQ(view->state().cells().size(), sure.size()) << "the image shows none";

  ASSERT_TRUE(view->ReadAgain(open_).ok());
  ASSERT_EQ(view->Find(one, {})->front(), std::nullopt);
  for (const PredictedCell& cell : predicted_) {
    const ViewCell* grown = view->state().Find(cell.row, cell.col);
    ASSERT_NE(grown, nullptr) << cell.row << " " << cell.col;
    EXPECT_LT(std::hypot(grown->fit.pose.x - cell.pose.x, grown->fit.pose.y - cell.pose.y), 0.2);
    EXPECT_GE(grown->confidence, DecodeOptions().confidence.min_to_stay);
  }
  for (const auto& [at, confidence] : sure) {
    ASSERT_NE(view->state().Find(at.first, at.second), nullptr);
    EXPECT_EQ(view->state().Find(at.first, at.second)->confidence, confidence);
  }
}

TEST_F(ViewDecoders, AnImageThatIsReadAgainGivesTheSame) {
  auto kept = *ViewDecoder::Read(open_, board_, {}), dropped = *ViewDecoder::Read(open_, board_, {});
  kept->Decode();
  dropped->Decode();
  EXPECT_GT(dropped->image_bytes(), open_.pixels->size());
  dropped->Rest(false);
  dropped->Wake();
  EXPECT_EQ(dropped->image_bytes(), 0u);
  ASSERT_TRUE(dropped->ReadAgain(open_).ok());
  ASSERT_TRUE(kept->Find(predicted_, {}).ok());
  ASSERT_TRUE(dropped->Find(predicted_, {}).ok());
  const std::vector<Observation> a = kept->Observations(), b = dropped->Observations();
  ASSERT_EQ(a.size(), b.size());
  for (size_t k = 0; k < a.size(); ++k)
    EXPECT_EQ(std::tuple(a[k].x_px, a[k].y_px), std::tuple(b[k].x_px, b[k].y_px));
}

TEST_F(ViewDecoders, RefuseWhatCannotBe) {
  const auto view = FirstPass();
  EXPECT_THAT(std::string(view->Find(predicted_, {}).status().message()), HasSubstr("read it again"));
  Frame other = Render({.width_px = 90, .height_px = 80}, board_.board());
  other.origin = "other.png";
  EXPECT_THAT(std::string(view->ReadAgain(other).message()),
              HasSubstr("other.png: the image has another size"));
  GuidedOptions bad;
  bad.min_lead = 2;
  EXPECT_THAT(std::string(view->Find(predicted_, bad).status().message()), HasSubstr("guided.min_lead"));
  Frame grey = open_;
  grey.format = PixelFormat::kGrey8;
  grey.pixels = std::make_shared<std::vector<uint8_t>>(open_.pixels->size() / 3, uint8_t{90});
  EXPECT_THAT(std::string(ViewDecoder::Read(grey, board_, {}).status().message()),
              HasSubstr("a grey image that shows nothing; is the lens covered"));
  const auto shades = std::make_shared<std::vector<uint8_t>>(open_.pixels->size() / 3);
  for (size_t i = 0; i < shades->size(); ++i) (*shades)[i] = static_cast<uint8_t>(i / 64);
  grey.pixels = shades;
  EXPECT_THAT(std::string(ViewDecoder::Read(grey, board_, {}).status().message()),
              HasSubstr("colours carry the code"));
}

TEST_F(ViewDecoders, LookForNothingInAViewOfFewCells) {
  const Frame blank = Render({.rows = 0, .cols = 0}, board_.board());
  auto view = *ViewDecoder::Read(blank, board_, {});
  view->Decode();
  const auto missing = view->Find(predicted_, {});
  ASSERT_TRUE(missing.ok());
  for (const auto& why : *missing) EXPECT_EQ(why, WhyMissing::kNoFit);
  EXPECT_TRUE(view->Observations().empty());
}

}  // namespace
}  // namespace weft
