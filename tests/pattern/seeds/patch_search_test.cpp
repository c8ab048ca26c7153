#include "pattern/seeds/patch_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

const BoardIndex& SearchedIndex() {
  static const BoardIndex index = *BoardIndex::Build(*GenerateBoard(80, 80, 3, 5));
  return index;
}
const Board& SearchedBoard() { return SearchedIndex().board(); }

std::vector<ColorImage> PyramidOf(const Frame& frame, int levels = 4) {
  std::vector<ColorImage> pyramid = {*ToColorImage(frame)};
  while (static_cast<int>(pyramid.size()) < levels) pyramid.push_back(HalfSize(pyramid.back()));
  return pyramid;
}

struct Search {
  std::vector<LevelPatch> patches;
  std::vector<LooseBlob> loose;
};

Search Find(const Frame& frame, int levels = 4) {
  Search search;
  search.patches = FindPatches(PyramidOf(frame, levels), {}, {}, &search.loose);
  return search;
}

// The board cell at a pixel, and how far from its middle it is, in cells.
std::pair<BoardCell, double> CellAt(const Photograph& photo, double x, double y) {
  const auto [u, v] = BoardFromPixel(photo, SearchedBoard(), x, y);
  const double col = std::floor(u), row = std::floor(v);
  return {{static_cast<int>(row), static_cast<int>(col)}, std::hypot(u - col - 0.5, v - row - 0.5)};
}

// Board cells in whose middle a patch of levels `first` to `last` has a keypoint.
size_t CellsOfLevels(const Photograph& photo, const Search& search, int first, int last) {
  std::set<BoardCell> cells;
  for (const LevelPatch& patch : search.patches) {
    if (patch.level < first || patch.level > last) continue;
    for (const Keypoint& p : patch.points) {
      const auto [cell, off] = CellAt(photo, p.x_px, p.y_px);
      if (off < 0.3) cells.insert(cell);
    }
  }
  return cells.size();
}

// Cells with their surroundings in the picture.
size_t CellsInPicture(const Photograph& photo) {
  size_t cells = 0;
  for (int row = 0; row < SearchedBoard().rows; ++row) {
    for (int col = 0; col < SearchedBoard().cols; ++col) {
      const auto [x, y] = PixelFromBoard(photo, SearchedBoard(), col + 0.5, row + 0.5);
      const double margin = photo.pitch_px;
      cells += x > margin && y > margin && x < photo.width_px - margin && y < photo.height_px - margin;
    }
  }
  return cells;
}

TEST(FindPatches, FindsCellsAtTheLevelOfTheirSize) {
  struct Case {
    double pitch_px;
    int first, last;
  };
  // Level k is for pitches of 3 to 6.5 px times 2^k, and joins edges of up to 9 px.
  for (const Case& c : {Case{4, 0, 0}, {8, 0, 1}, {16, 1, 2}, {30, 3, 3}}) {
    const int side = static_cast<int>(std::min(c.pitch_px < 20 ? 230.0 : 300.0, 30 * c.pitch_px));
    const Photograph photo{.width_px = side, .height_px = side, .pitch_px = c.pitch_px, .bend_cells = 0.2};
    const Search search = Find(Render(photo, SearchedBoard()));
    const size_t cells = CellsOfLevels(photo, search, c.first, c.last), there = CellsInPicture(photo);
    EXPECT_GE(static_cast<double>(cells), 0.9 * static_cast<double>(there)) << c.pitch_px << " px";
    for (const LevelPatch& patch : search.patches) {
      EXPECT_EQ(patch.scale, static_cast<float>(1 << patch.level));
      EXPECT_GE(patch.points.size(), 9u);
      EXPECT_EQ(patch.points.size(), patch.measured.lattice.cells.size());
      if (patch.points.size() < there / 2) continue;
      EXPECT_TRUE(patch.level >= c.first && patch.level <= c.last) << c.pitch_px << " px";
      for (const PatchCell& cell : patch.measured.lattice.cells) {
        if (!cell.has_frame()) continue;
        const double edge_px = patch.scale * std::sqrt(cell.ax * cell.by - cell.ay * cell.bx);
        EXPECT_NEAR(edge_px, c.pitch_px, 0.2 * c.pitch_px);
      }
    }
  }
}

TEST(FindPatches, KeypointsLieInTheFullImage) {
  // Half a pixel of the largest halving is 2 px of the image.
  const Photograph photo{.width_px = 260, .height_px = 240, .pitch_px = 16, .bend_cells = 0.2, .noise = 1};
  const Search search = Find(Render(photo, SearchedBoard()));
  double sum_x = 0, sum_y = 0;
  int n = 0;
  for (const LevelPatch& patch : search.patches) {
    if (patch.level != 2) continue;
    for (const Keypoint& p : patch.points) {
      const auto [cell, off] = CellAt(photo, p.x_px, p.y_px);
      if (off > 0.25) continue;
      const auto [x, y] = PixelFromBoard(photo, SearchedBoard(), cell.col + 0.5, cell.row + 0.5);
      sum_x += p.x_px - x;
      sum_y += p.y_px - y;
      ++n;
    }
  }
  ASSERT_GT(n, 100);
  EXPECT_NEAR(sum_x / n, 0, 0.25);
  EXPECT_NEAR(sum_y / n, 0, 0.25);
}

TEST(FindPatches, WhatHasBeenFoundIsNotSearchedAgain) {
  // Half of 6.4 px are cells of the next level, too.
  const Photograph photo{.width_px = 200, .height_px = 200, .pitch_px = 6.4, .bend_cells = 0.2};
  const Search search = Find(Render(photo, SearchedBoard()));
  const size_t cells = CellsOfLevels(photo, search, 0, 0);
  EXPECT_GE(cells, 700u);
  const auto inside = [](float x, float y) { return std::min({x, y, 199 - x, 199 - y}) > 30; };
  for (const LevelPatch& patch : search.patches) {
    if (patch.level == 0) continue;
    for (const Keypoint& p : patch.points) EXPECT_FALSE(inside(p.x_px, p.y_px)) << "level " << patch.level;
  }
  const auto again = std::count_if(search.loose.begin(), search.loose.end(), [&](const auto& spot) {
    return spot.level > 0 && inside(spot.x_px, spot.y_px);
  });
  EXPECT_LT(static_cast<double>(again), 0.02 * static_cast<double>(cells));
}

TEST(FindPatches, LatticesThatSplitCellsDoNotHideThem) {
  // So sharp that the corners of the squares are spots of the first level, four to a cell.
  for (const double pitch_px : {9.0, 10.0}) {
    const Photograph photo{.width_px = 160,
                           .height_px = 150,
                           .pitch_px = pitch_px,
                           .angle_deg = 4,
                           .bend_cells = 0.1,
                           .blur_px = 0.3,
                           .noise = 1};
    const Search search = Find(Render(photo, SearchedBoard()));
    const size_t there = CellsInPicture(photo);
    size_t finest = 0;
    for (const LevelPatch& patch : search.patches)
      finest = std::max(finest, patch.level == 0 ? patch.points.size() : 0);
    EXPECT_GE(finest, 3 * there) << "or nothing is tried here";
    EXPECT_EQ(CellsOfLevels(photo, search, 0, 0), 0u);
    EXPECT_GE(static_cast<double>(CellsOfLevels(photo, search, 1, 1)), 0.9 * static_cast<double>(there));
  }
}

TEST(FindPatches, NothingOnClothWithoutPrint) {
  const Photograph photo{.width_px = 140, .height_px = 120, .rows = 0, .cols = 0};
  const Search search = Find(Render(photo, SearchedBoard()));
  EXPECT_TRUE(search.patches.empty());
  EXPECT_TRUE(search.loose.empty());
}

struct Decoded {
  Search search;
  InkModel inks;

  Decoded(const Frame& frame, const BoardIndex& index)
      : search(Find(frame, 3)), inks(DecodePatches(index, {}, &search.patches)) {}

  size_t Standing() const {
    size_t cells = 0;
    for (const LevelPatch& patch : search.patches) {
      for (const DecodedPiece& piece : patch.pieces)
        cells += WhyRejected(patch, piece, {}).empty() ? piece.cells.size() : 0;
    }
    return cells;
  }
};

TEST(DecodePatches, ReadsPrintsOfAnyFadeUnderAnyTurn) {
  for (const double fade : {0.0, 0.35, 0.6}) {
    for (const double angle_deg : {20.0, 200.0}) {
      const Photograph photo{.width_px = 150, .height_px = 140, .angle_deg = angle_deg, .fade = fade};
      const Decoded decoded(Render(photo, SearchedBoard()), SearchedIndex());
      size_t right = 0, wrong = 0;
      for (const LevelPatch& patch : decoded.search.patches) {
        for (const DecodedPiece& piece : patch.pieces) {
          if (!WhyRejected(patch, piece, {}).empty()) continue;
          for (const int k : piece.cells) {
            const PatchCell& cell = patch.measured.lattice.cells[k];
            const auto [there, off] = CellAt(photo, patch.points[k].x_px, patch.points[k].y_px);
            ++(piece.pose.ToBoard(cell.i, cell.j) == there && off < 0.4 ? right : wrong);
          }
        }
      }
      EXPECT_EQ(wrong, 0u) << "fade " << fade << " turned " << angle_deg;
      EXPECT_GE(static_cast<double>(right), 0.9 * static_cast<double>(CellsInPicture(photo)))
          << "fade " << fade << " turned " << angle_deg;
    }
  }
}

TEST(DecodePatches, LearnsTheInksOfTheView) {
  const Photograph photo{.width_px = 180, .height_px = 170, .fade = 0.45};
  const Decoded decoded(Render(photo, SearchedBoard()), SearchedIndex());
  // Inks relative to their mean, as a measurement relative to the light around is; blur mixes them with the
  // lines, which takes no colour away from the others.
  std::array<std::array<double, 3>, kCellColors> truth{};
  double mean = 0, learnt_mean = 0;
  for (int k = 0; k < kCellColors; ++k) {
    const auto rgb = CellColorRgb(static_cast<CellColor>(k));
    const double grey = (rgb[0] + rgb[1] + rgb[2]) / 3.0;
    for (int c = 0; c < 3; ++c) {
      truth[k][c] = (1 - photo.fade) * rgb[c] + photo.fade * grey;
      mean += truth[k][c] / (3 * kCellColors);
      learnt_mean += decoded.inks.mean(static_cast<CellColor>(k))[c] / (3 * kCellColors);
    }
  }
  for (int k = 0; k < kCellColors; ++k) {
    for (int c = 0; c < 3; ++c) {
      const double learnt = decoded.inks.mean(static_cast<CellColor>(k))[c] / learnt_mean;
      EXPECT_NEAR(learnt, truth[k][c] / mean, 0.12) << "ink " << k << " channel " << c;
    }
  }
}

TEST(DecodePatches, RefusesMirrorsAndOtherBoards) {
  Photograph photo{.width_px = 170, .height_px = 160};
  photo.mirrored = true;
  const Decoded mirrored(Render(photo, SearchedBoard()), SearchedIndex());
  EXPECT_EQ(mirrored.Standing(), 0u);
  ASSERT_FALSE(mirrored.search.patches.empty());
  EXPECT_TRUE(mirrored.search.patches.front().mirrored) << "the largest comes first";
  photo.mirrored = false;
  const Board other = *GenerateBoard(80, 80, 3, 99);
  const Decoded foreign(Render(photo, other), SearchedIndex());
  EXPECT_EQ(foreign.Standing(), 0u);
  const Decoded upright(Render(photo, SearchedBoard()), SearchedIndex());
  EXPECT_GE(upright.Standing(), 400u);
  EXPECT_TRUE(std::is_sorted(
      upright.search.patches.begin(), upright.search.patches.end(),
      [](const LevelPatch& s, const LevelPatch& t) { return s.points.size() > t.points.size(); }));
}

TEST(DecodePatches, SeedsLieOnTheBoardWithTheirEdges) {
  for (const double angle_deg : {10.0, 100.0, 190.0, 280.0}) {
    const Photograph photo{.width_px = 110, .height_px = 110, .pitch_px = 5, .angle_deg = angle_deg};
    const Decoded decoded(Render(photo, SearchedBoard()), SearchedIndex());
    const std::vector<PlacedCell> seeds = SeedsOf(decoded.search.patches, SearchedBoard(), {});
    ASSERT_GE(seeds.size(), 150u);
    for (const auto& [row, col, frame, group, is_read] : seeds) {
      const auto at = [&, r = row, c = col](double du, double dv) {
        return PixelFromBoard(photo, SearchedBoard(), c + 0.5 + du, r + 0.5 + dv);
      };
      const auto [x, y] = at(0, 0);
      const auto [ax, ay] = at(1, 0);
      const auto [bx, by] = at(0, 1);
      EXPECT_LT(std::hypot(frame.x - x, frame.y - y), 1) << row << " " << col;
      EXPECT_LT(std::hypot(frame.ax - (ax - x), frame.ay - (ay - y)), 1) << row << " " << col;
      EXPECT_LT(std::hypot(frame.bx - (bx - x), frame.by - (by - y)), 1) << row << " " << col;
    }
  }
}

TEST(DecodePatches, EveryPointStandsOrIsUnread) {
  const Photograph photo{.width_px = 170, .height_px = 160, .rows = 60, .cols = 45};
  const Decoded decoded(Render(photo, SearchedBoard()), SearchedIndex());
  std::vector<LooseBlob> unread;
  AddUnread(decoded.search.patches, {}, &unread);
  size_t points = 0;
  for (const LevelPatch& patch : decoded.search.patches) points += patch.points.size();
  EXPECT_EQ(unread.size() + decoded.Standing(), points);
  // With limits that nothing meets all are unread, and nothing is a seed.
  PatchDecodeOptions strict;
  strict.min_evidence = 1e9f;
  unread.clear();
  AddUnread(decoded.search.patches, strict, &unread);
  EXPECT_EQ(unread.size(), points);
  EXPECT_TRUE(SeedsOf(decoded.search.patches, SearchedBoard(), strict).empty());
}

}  // namespace
}  // namespace weft
