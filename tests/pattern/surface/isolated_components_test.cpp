#include "pattern/surface/isolated_components.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/pattern/surface/rendered_surface.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int kSheetRows = 60, kSheetCols = 60;
// Columns of the print: known ones end at the first, a cover between both, then a strip; grey cloth after it.
constexpr int kCover = 30, kStrip = 33, kEnd = 36;

class IsolatedSeeds : public testing::Test {
 protected:
  IsolatedSeeds() {
    for (const PlacedCell& cell : TrueCells(photo_, board_, 1.6)) {
      if (cell.col < kCover) {
        known_.push_back(cell);
      } else if (cell.col >= kStrip && cell.col < kEnd) {
        strip_.push_back(cell);
        blobs_.push_back({cell.pose.x + 0.3f, cell.pose.y - 0.3f, 0});
      }
    }
  }

  // The colour of a pixel, over the light of the cells around.
  InkModel TrueInks() const {
    const auto pixel = [&](const PlacedCell& cell, int c) {
      const int x = static_cast<int>(std::lround(cell.pose.x)),
                y = static_cast<int>(std::lround(cell.pose.y));
      return static_cast<float>((*frame_.pixels)[3 * (static_cast<size_t>(y) * frame_.width_px + x) + c]);
    };
    std::vector<InkSample> samples;
    for (const PlacedCell& cell : known_) {
      float light = 0;
      int count = 0;
      for (const PlacedCell& other : known_) {
        if (std::max(std::abs(other.row - cell.row), std::abs(other.col - cell.col)) > 1) continue;
        for (int c = 0; c < 3; ++c) light += pixel(other, c);
        count += 3;
      }
      InkSample sample{.color = {}, .label = board_.at(cell.row, cell.col)};
      for (int c = 0; c < 3; ++c) sample.color[c] = pixel(cell, c) * static_cast<float>(count) / light;
      samples.push_back(sample);
    }
    return InkModel::Fitted(samples, InkModel::Faded(static_cast<float>(photo_.fade), {1, 1, 1}));
  }

  std::vector<PlacedCell> FindOn(const Board& board) const {
    const FrameFitter fitter(frame_, photo_, board);
    BoardState state(board, photo_.width_px, photo_.height_px);
    for (const PlacedCell& cell : known_) {
      ViewCell known;
      known.row = cell.row;
      known.col = cell.col;
      known.fit.pose = cell.pose;
      known.fit.explained = 0.8f;
      known.group = kGroup;
      state.Add(known);
    }
    return FindIsolatedSeeds(fitter.get(), TrueInks(), state, blobs_, options_);
  }

  bool IsRight(const PlacedCell& seed) const {
    ViewCell cell;
    cell.row = seed.row;
    cell.col = seed.col;
    cell.fit.pose = seed.pose;
    return ErrorCells(photo_, board_, cell) < 0.2;
  }

  // Cells of the strip that are among the seeds, where they are.
  size_t CountRead(const std::vector<PlacedCell>& seeds) const {
    std::set<std::pair<int, int>> read;
    for (const PlacedCell& seed : seeds) {
      if (IsRight(seed)) read.insert({seed.row, seed.col});
    }
    return read.size();
  }

  static constexpr int kGroup = 4;
  const Photograph photo_{.width_px = 220, .height_px = 200, .pitch_px = 7};
  const Board board_ = *GenerateBoard(kSheetRows, kSheetCols, 3, 5);
  const Frame frame_ = CoveredWhere(Render(photo_, board_), photo_, board_, [](double u, double) {
    return (u >= kCover && u < kStrip) || u >= kEnd;
  });
  std::vector<PlacedCell> known_, strip_;
  std::vector<LooseBlob> blobs_;
  IsolatedOptions options_;
};

TEST_F(IsolatedSeeds, AreTheCellsBeyondACover) {
  const std::vector<PlacedCell> seeds = FindOn(board_);
  ASSERT_GT(strip_.size(), 50u);
  EXPECT_GT(CountRead(seeds), strip_.size() * 8 / 10);
  const auto wrong =
      std::count_if(seeds.begin(), seeds.end(), [&](const auto& seed) { return !IsRight(seed); });
  EXPECT_LT(wrong, static_cast<int>(seeds.size()) / 10);
  std::set<int> groups = {kGroup};
  for (const PlacedCell& seed : seeds) EXPECT_TRUE(groups.insert(seed.group).second) << "a group of its own";
  EXPECT_EQ(*groups.begin(), kGroup) << "new groups come after those that are known";
}

TEST_F(IsolatedSeeds, AreFewOnAWrongBoard) {
  const std::vector<PlacedCell> seeds = FindOn(*GenerateBoard(kSheetRows, kSheetCols, 3, 99));
  EXPECT_LE(seeds.size(), blobs_.size() / 20);
}

TEST_F(IsolatedSeeds, AreNotReadInKnownCells) {
  known_.insert(known_.end(), strip_.begin(), strip_.end());
  EXPECT_TRUE(FindOn(board_).empty());
}

TEST_F(IsolatedSeeds, AreNoBoardCellsThatAreKnownElsewhere) {
  // Every second cell of the strip is known, far away in the image.
  std::set<std::pair<int, int>> elsewhere;
  for (size_t k = 0; k < strip_.size(); k += 2) {
    known_.push_back(strip_[k]);
    known_.back().pose.x = 200;
    known_.back().pose.y = 10;
    elsewhere.insert({strip_[k].row, strip_[k].col});
  }
  const std::vector<PlacedCell> seeds = FindOn(board_);
  EXPECT_GT(CountRead(seeds), strip_.size() * 3 / 10) << "of the half that is left";
  for (const PlacedCell& seed : seeds) EXPECT_FALSE(elsewhere.contains({seed.row, seed.col}));
}

TEST_F(IsolatedSeeds, AreWithinReachOnTheBoard) {
  options_.reach_cells = 3;  // the last known column is four before the strip
  EXPECT_EQ(CountRead(FindOn(board_)), 0u);
}

TEST_F(IsolatedSeeds, AreWithinReachInTheImage) {
  std::erase_if(known_, [](const PlacedCell& cell) { return cell.col > kCover - 12; });
  EXPECT_TRUE(FindOn(board_).empty());
}

TEST_F(IsolatedSeeds, NeedEvidence) {
  options_.min_evidence = 100;
  EXPECT_TRUE(FindOn(board_).empty());
}

TEST_F(IsolatedSeeds, OfOnePlaceAreReadOnce) {
  const size_t once = FindOn(board_).size();
  const std::vector<LooseBlob> blobs = blobs_;
  for (LooseBlob blob : blobs) {
    blob.x_px += 0.5f;
    blob.level = 1;
    blobs_.push_back(blob);
  }
  EXPECT_EQ(FindOn(board_).size(), once);
}

TEST_F(IsolatedSeeds, NeedBlobs) {
  blobs_.clear();
  EXPECT_TRUE(FindOn(board_).empty());
}

TEST(IsolatedOptionsTest, AreChecked) {
  IsolatedOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.reach_cells = 0;
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("isolated.reach_cells"));
  options = {.min_evidence = 0};
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("isolated.min_evidence"));
}

}  // namespace
}  // namespace weft
