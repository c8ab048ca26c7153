#include "pattern/seeds/strip_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace weft {
namespace {

constexpr float kRightStrip = 1.9f, kWrongStrip = -4;

const BoardIndex& StripTestIndex() {
  static const BoardIndex index = *BoardIndex::Build(*GenerateBoard(70, 90, 3, 7));
  return index;
}
const Board& StripBoard() { return StripTestIndex().board(); }

CellReading StripReading(int color, float lead = kRightStrip - kWrongStrip) {
  CellReading reading;
  reading.evidence.fill(kWrongStrip);
  reading.best = static_cast<uint8_t>(color);
  reading.second = static_cast<uint8_t>((color + 1) % kCellColors);
  reading.evidence[reading.best] = kRightStrip;
  reading.evidence[reading.second] = kRightStrip - lead;
  reading.lead = lead;
  return reading;
}

// A patch of so many rows and columns that begins at (-3, -5), with cells of the board where from(i, j) says.
MeasuredPatch PatchOf(int rows, int cols, const std::function<BoardCell(int, int)>& from) {
  MeasuredPatch patch;
  patch.lattice.i_min = -3;
  patch.lattice.j_min = -5;
  patch.lattice.i_max = rows - 4;
  patch.lattice.j_max = cols - 6;
  for (int k = 0; k < rows * cols; ++k) {
    const int i = k / cols, j = k % cols;
    const BoardCell at = from(i, j);
    patch.lattice.cells.push_back({i - 3, j - 5, k, 5, 0, 0, 5});
    patch.readings.push_back(StripReading(static_cast<int>(StripBoard().at(at.row, at.col))));
    patch.grid.push_back(k);
  }
  return patch;
}

// Centers that a piece puts where they come from.
int RightCenters(const MeasuredPatch& patch, const DecodedPiece& piece, int cols,
                 const std::function<BoardCell(int, int)>& from) {
  int right = 0;
  for (const int k : piece.centers) {
    const PatchCell& cell = patch.lattice.cells[k];
    right += piece.pose.ToBoard(cell.i, cell.j) == from(k / cols, k % cols);
  }
  return right;
}

TEST(StripDecoder, ReadsStripsOfTwoCellsUnderAllRotations) {
  const std::map<int, std::function<BoardCell(int, int)>> views = {{0,
                                                                    [](int i, int j) {
                                                                      return BoardCell{20 + i, 30 + j};
                                                                    }},
                                                                   {1,
                                                                    [](int i, int j) {
                                                                      return BoardCell{20 + j, 30 - i};
                                                                    }},
                                                                   {2,
                                                                    [](int i, int j) {
                                                                      return BoardCell{20 - i, 30 - j};
                                                                    }},
                                                                   {3, [](int i, int j) {
                                                                      return BoardCell{40 - j, 30 + i};
                                                                    }}};
  for (const auto& [turns, from] : views) {
    for (const auto& [rows, cols] : {std::pair{2, 9}, {9, 2}}) {
      const MeasuredPatch patch = PatchOf(rows, cols, from);
      const auto pieces = DecodeStrip(patch, StripTestIndex());
      ASSERT_GE(pieces.size(), 1u) << "turned " << turns;
      EXPECT_EQ(pieces[0].cells.size(), 18u);
      EXPECT_EQ(RightCenters(patch, pieces[0], cols, from), 14)
          << "turned " << turns << ", " << rows << " rows";
      EXPECT_EQ(pieces[0].pose.quarter_turns, turns);
      EXPECT_FLOAT_EQ(pieces[0].evidence, 18 * kRightStrip);
      EXPECT_GT(pieces[0].margin, 12);
    }
  }
}

// Squeezed cells: the lattice takes a cell two rows below for the one beside.
TEST(StripDecoder, ReadsRowsThatAreShiftedAgainstEachOther) {
  for (const bool upright : {false, true}) {
    const auto from = [upright](int i, int j) {
      return upright ? BoardCell{8 + i - 2 * j, 50 + j} : BoardCell{8 + j - 2 * i, 50 + i};
    };
    const int rows = upright ? 20 : 2, cols = upright ? 2 : 20;
    const MeasuredPatch patch = PatchOf(rows, cols, from);
    const auto pieces = DecodeStrip(patch, StripTestIndex());
    ASSERT_GE(pieces.size(), 2u);
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(pieces[k].cells.size(), 20u);
      EXPECT_EQ(RightCenters(patch, pieces[k], cols, from), 18);
      EXPECT_FLOAT_EQ(pieces[k].evidence, 20 * kRightStrip);
    }
  }
}

TEST(StripDecoder, StripsSideBySideAreTwoPieces) {
  const auto from = [](int i, int j) {
    return i < 2 ? BoardCell{30 + j, 12 - i} : BoardCell{35 + j, 70 - i};
  };
  const MeasuredPatch patch = PatchOf(4, 24, from);
  const auto pieces = DecodeStrip(patch, StripTestIndex());
  ASSERT_GE(pieces.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    EXPECT_GE(pieces[k].centers.size(), 38u);
    EXPECT_EQ(RightCenters(patch, pieces[k], 24, from), static_cast<int>(pieces[k].centers.size()));
  }
}

TEST(StripDecoder, MisreadCellsCostTheirWindowsOnly) {
  const auto from = [](int i, int j) { return BoardCell{5 + i, 40 + j}; };
  MeasuredPatch patch = PatchOf(2, 30, from);
  std::mt19937 random(3);
  std::vector<int> misread;
  for (int k = 3; k < 60; k += 10) {
    patch.readings[k] =
        StripReading((patch.readings[k].best + 1 + static_cast<int>(random() % 5)) % kCellColors);
    misread.push_back(k);
  }
  const auto pieces = DecodeStrip(patch, StripTestIndex());
  ASSERT_GE(pieces.size(), 1u);
  EXPECT_GE(pieces[0].cells.size(), 30u);
  EXPECT_EQ(RightCenters(patch, pieces[0], 30, from), static_cast<int>(pieces[0].centers.size()));
  for (const int k : misread) {
    EXPECT_EQ(std::count(pieces[0].cells.begin(), pieces[0].cells.end(), k), 0) << k;
  }
}

TEST(StripDecoder, AWeakCellIsReadAsItsRunnerUp) {
  const auto from = [](int i, int j) { return BoardCell{5 + i, 40 + j}; };
  MeasuredPatch patch = PatchOf(2, 8, from);
  const int there = patch.readings[3].best;
  patch.readings[3] = StripReading((there + 6) % kCellColors, 1);
  const auto pieces = DecodeStrip(patch, StripTestIndex());
  ASSERT_GE(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].cells.size(), 16u);
  EXPECT_FLOAT_EQ(pieces[0].evidence, 16 * kRightStrip - 1);
}

TEST(StripDecoder, RandomColoursHaveLittleEvidence) {
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    const auto from = [&random](int, int) {
      return BoardCell{static_cast<int>(random() % 70), static_cast<int>(random() % 90)};
    };
    for (const DecodedPiece& piece : DecodeStrip(PatchOf(3, 40, from), StripTestIndex()))
      EXPECT_LT(piece.evidence, 25);
  }
}

TEST(StripDecoder, PlacedCellsHaveTheEdgesOfTheirNeighbours) {
  // Two columns of three, the edges of which change along the rows.
  std::vector<std::pair<BoardCell, Keypoint>> cells;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 2; ++col) {
      const auto r = static_cast<float>(row), c = static_cast<float>(col);
      cells.push_back({{10 + row, 20 + col}, {50 + 3 * c + 0.5f * r, 60 + 5 * r + 0.25f * r * r, 0}});
    }
  }
  cells.push_back({{30, 30}, {90, 90, 0}});
  cells.push_back({{30, 31}, {95, 90, 0}});
  const std::vector<PlacedCell> placed = PlaceCells(cells);
  ASSERT_EQ(placed.size(), 6u) << "not those without a neighbour in their column";
  const CellPose& middle = placed[2].pose;
  EXPECT_EQ(placed[2].row, 11);
  EXPECT_EQ(placed[2].col, 20);
  EXPECT_FLOAT_EQ(middle.x, 50.5f);
  EXPECT_FLOAT_EQ(middle.ax, 3);
  EXPECT_FLOAT_EQ(middle.ay, 0);
  EXPECT_FLOAT_EQ(middle.bx, 0.5f);
  EXPECT_FLOAT_EQ(middle.by, 5.5f) << "mean of both sides";
  EXPECT_FLOAT_EQ(placed[0].pose.by, 5.25f) << "of one side";
  EXPECT_FLOAT_EQ(placed[5].pose.by, 5.75f);
  EXPECT_FLOAT_EQ(placed[5].pose.ax, 3);
  // In a mirror.
  for (auto& [cell, point] : cells) point.x_px = 200 - point.x_px;
  EXPECT_TRUE(PlaceCells(cells).empty());
}

}  // namespace
}  // namespace weft
