#include "pattern/seeds/patch_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "pattern/seeds/patch_search.h"

namespace weft {
namespace {

constexpr float kRight = 2, kWrong = -3;  // nats, of the ink that is there and of the others

const BoardIndex& PatchTestIndex() {
  static const BoardIndex index = *BoardIndex::Build(*GenerateBoard(60, 60, 3, 7));
  return index;
}
const Board& PatchBoard() { return PatchTestIndex().board(); }

// Colours as read in the order of a patch's cells, and where they come from.
struct Picture {
  int rows, cols;
  std::vector<CellColor> colors;
  std::vector<std::optional<BoardCell>> from;

  size_t At(int i, int j) const { return static_cast<size_t>(i) * cols + j; }
};

Picture PartOf(const Board& board, int row, int col, int rows, int cols) {
  Picture picture{rows, cols, {}, {}};
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) {
      picture.colors.push_back(board.at(row + i, col + j));
      picture.from.push_back(BoardCell{row + i, col + j});
    }
  }
  return picture;
}

// The camera turned by a quarter turn.
Picture Turned(const Picture& picture) {
  Picture out = picture;
  std::swap(out.rows, out.cols);
  for (int i = 0; i < out.rows; ++i) {
    for (int j = 0; j < out.cols; ++j) {
      out.colors[out.At(i, j)] = picture.colors[picture.At(j, picture.cols - 1 - i)];
      out.from[out.At(i, j)] = picture.from[picture.At(j, picture.cols - 1 - i)];
    }
  }
  return out;
}

Picture Mirrored(Picture picture) {
  for (int i = 0; i < picture.rows; ++i) {
    std::reverse(picture.colors.begin() + i * picture.cols, picture.colors.begin() + (i + 1) * picture.cols);
    std::reverse(picture.from.begin() + i * picture.cols, picture.from.begin() + (i + 1) * picture.cols);
  }
  return picture;
}

Picture Random(int rows, int cols, uint32_t seed) {
  std::mt19937 random(seed);
  Picture picture{rows, cols, {}, {}};
  for (int k = 0; k < rows * cols; ++k) {
    picture.colors.push_back(static_cast<CellColor>(random() % kCellColors));
    picture.from.push_back(std::nullopt);
  }
  return picture;
}

CellReading Reading(CellColor color, float lead = kRight - kWrong) {
  CellReading reading;
  reading.evidence.fill(kWrong);
  reading.best = static_cast<uint8_t>(color);
  reading.second = static_cast<uint8_t>((reading.best + 1) % kCellColors);
  reading.evidence[reading.best] = kRight;
  reading.evidence[reading.second] = kRight - lead;
  reading.lead = lead;
  return reading;
}

// Cells (i, j) of the patch begin at `first`, as those of a patch that grew from its middle.
MeasuredPatch Measured(const Picture& picture, int first = -2) {
  MeasuredPatch patch;
  patch.lattice.i_min = patch.lattice.j_min = first;
  patch.lattice.i_max = first + picture.rows - 1;
  patch.lattice.j_max = first + picture.cols - 1;
  for (int k = 0; k < picture.rows * picture.cols; ++k) {
    patch.lattice.cells.push_back({first + k / picture.cols, first + k % picture.cols, k, 5, 0, 0, 5});
    patch.colors.push_back({1, 1, 1});
    patch.readings.push_back(Reading(picture.colors[k]));
    patch.grid.push_back(k);
  }
  return patch;
}

// Cells of the piece that its pose puts where they come from.
int RightCells(const MeasuredPatch& patch, const DecodedPiece& piece, const Picture& picture) {
  int right = 0;
  for (const int k : piece.cells) {
    const PatchCell& cell = patch.lattice.cells[k];
    right += picture.from[k].has_value() && piece.pose.ToBoard(cell.i, cell.j) == *picture.from[k];
  }
  return right;
}

std::string Why(const DecodedPiece& piece) { return WhyRejected({}, piece, {}); }

TEST(PatchDecoder, ReadsThePoseUnderAllRotations) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    Picture picture = PartOf(PatchBoard(), static_cast<int>(random() % 50), static_cast<int>(random() % 47),
                             3 + trial % 8, 4 + trial % 10);
    for (int turn = 0; turn < 4; ++turn, picture = Turned(picture)) {
      const MeasuredPatch patch = Measured(picture, -trial);
      const auto pieces = DecodePatch(patch, PatchTestIndex());
      ASSERT_EQ(pieces.size(), 1u);
      const size_t cells = picture.colors.size();
      EXPECT_EQ(pieces[0].cells.size(), cells);
      EXPECT_EQ(RightCells(patch, pieces[0], picture), static_cast<int>(cells)) << "turned " << turn;
      EXPECT_EQ(pieces[0].centers.size(), static_cast<size_t>((picture.rows - 2) * (picture.cols - 2)));
      EXPECT_FLOAT_EQ(pieces[0].evidence, kRight * static_cast<float>(cells));
      EXPECT_EQ(pieces[0].contradicted, 0);
      EXPECT_EQ(Why(pieces[0]), "");
    }
  }
}

TEST(PatchDecoder, APatchJoinedWronglyReadsAsTwoPieces) {
  for (uint32_t seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    const int row = static_cast<int>(random() % 20), col = static_cast<int>(random() % 40);
    Picture left = PartOf(PatchBoard(), row, col, 10, 7),
            right = PartOf(PatchBoard(), row + 25, col, seed % 2 == 0 ? 6 : 10, seed % 2 == 0 ? 10 : 6);
    if (seed % 2 == 0) right = Turned(right);
    Picture picture = Random(10, 13, seed);
    for (int k = 0; k < 130; ++k) {
      const int i = k / 13, j = k % 13;
      const Picture& part = j < 7 ? left : right;
      picture.colors[k] = part.colors[part.At(i, j < 7 ? j : j - 7)];
      picture.from[k] = part.from[part.At(i, j < 7 ? j : j - 7)];
    }
    const MeasuredPatch patch = Measured(picture);
    const auto pieces = DecodePatch(patch, PatchTestIndex());
    ASSERT_GE(pieces.size(), 2u);
    EXPECT_EQ(RightCells(patch, pieces[0], picture), 70);
    EXPECT_EQ(RightCells(patch, pieces[1], picture), 60);
    std::set<int> cells;
    for (const DecodedPiece& piece : pieces) {
      for (const int cell : piece.cells) EXPECT_TRUE(cells.insert(cell).second) << "in one piece at most";
      EXPECT_EQ(Why(piece).empty(),
                RightCells(patch, piece, picture) == static_cast<int>(piece.cells.size()));
    }
  }
}

TEST(PatchDecoder, AWeakCellIsReadAsItsRunnerUp) {
  for (int k = 0; k < 9; ++k) {
    const Picture picture = PartOf(PatchBoard(), 11, 23, 3, 3);
    MeasuredPatch patch = Measured(picture);
    // The ink that is there comes second.
    const CellColor there = picture.colors[k];
    const auto misread = static_cast<CellColor>((static_cast<int>(there) + 6) % kCellColors);
    patch.readings[k] = Reading(misread, 1);
    auto pieces = DecodePatch(patch, PatchTestIndex());
    ASSERT_EQ(pieces.size(), 1u) << "cell " << k;
    EXPECT_EQ(RightCells(patch, pieces[0], picture), 9);
    EXPECT_FLOAT_EQ(pieces[0].evidence, 8 * kRight + (kRight - 1));
    // A clear misreading is believed, and the board has no such window.
    patch.readings[k] = Reading(misread);
    pieces = DecodePatch(patch, PatchTestIndex());
    for (const DecodedPiece& piece : pieces) EXPECT_LT(RightCells(patch, piece, picture), 9);
  }
}

TEST(PatchDecoder, CellsThatAreMisreadInsideALargePatchCostTheirWindowsOnly) {
  const Picture picture = PartOf(PatchBoard(), 5, 9, 12, 12);
  MeasuredPatch patch = Measured(picture);
  const size_t at = picture.At(6, 6);
  patch.readings[at] =
      Reading(static_cast<CellColor>((static_cast<int>(picture.colors[at]) + 3) % kCellColors));
  const auto pieces = DecodePatch(patch, PatchTestIndex());
  ASSERT_GE(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].cells.size(), 143u);
  EXPECT_EQ(pieces[0].centers.size(), 91u);
  EXPECT_EQ(pieces[0].contradicted, 1);
  EXPECT_EQ(Why(pieces[0]), "");
}

TEST(PatchDecoder, ChanceHitsAreContradictedByTheCellsAround) {
  // One window of the board among cells of which none is what the board has there.
  const Picture truth = PartOf(PatchBoard(), 20, 30, 7, 7);
  Picture picture = truth;
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 7; ++j) {
      if (i >= 2 && i < 5 && j >= 2 && j < 5) continue;
      CellColor& color = picture.colors[picture.At(i, j)];
      color = static_cast<CellColor>((static_cast<int>(color) + 1 + (i + 2 * j) % 6) % kCellColors);
    }
  }
  const auto pieces = DecodePatch(Measured(picture), PatchTestIndex());
  const auto hit = std::find_if(pieces.begin(), pieces.end(), [&](const DecodedPiece& piece) {
    return piece.cells.size() == 9 && piece.cells[4] == static_cast<int>(picture.At(3, 3));
  });
  ASSERT_NE(hit, pieces.end());
  EXPECT_EQ(hit->contradicted, 16);
  EXPECT_EQ(Why(*hit), "contradicted by the cells around");
}

// The lattice goes on across a fold on both sides of a narrow strip.
TEST(PatchDecoder, StripsBetweenFoldsStandWhateverIsBesideThem) {
  Picture picture = Random(12, 9, 5);
  const Picture strip = PartOf(PatchBoard(), 14, 33, 12, 3);
  for (int i = 0; i < 12; ++i) {
    for (int j = 3; j < 6; ++j) {
      picture.colors[picture.At(i, j)] = strip.colors[strip.At(i, j - 3)];
      picture.from[picture.At(i, j)] = strip.from[strip.At(i, j - 3)];
    }
  }
  const MeasuredPatch patch = Measured(picture);
  const auto pieces = DecodePatch(patch, PatchTestIndex());
  ASSERT_GE(pieces.size(), 1u);
  EXPECT_EQ(RightCells(patch, pieces[0], picture), 36);
  EXPECT_GT(pieces[0].contradicted, 9) << "a quarter of its cells";
  EXPECT_EQ(Why(pieces[0]), "");
}

TEST(PatchDecoder, TheMarginIsTheLeadOverTheRunnerUpOnTheSameCells) {
  // Two windows on one patch that overlap in a column: each one's cells speak for it, the shared ones too
  // where the board has the same colours there.
  const Picture picture = PartOf(PatchBoard(), 30, 8, 3, 3);
  MeasuredPatch alone = Measured(picture);
  auto pieces = DecodePatch(alone, PatchTestIndex());
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_FLOAT_EQ(pieces[0].margin, 9 * kRight) << "random colours are the runner-up";

  // A weak cell whose runner-up makes another window of the board is a tie but for the cell's lead.
  std::mt19937 random(3);
  const Board dense = *GenerateBoard(300, 300, 3, 9);
  const BoardIndex index = *BoardIndex::Build(dense);
  int compared = 0;
  for (int trial = 0; trial < 4000 && compared < 10; ++trial) {
    const Picture part =
        PartOf(dense, static_cast<int>(random() % 297), static_cast<int>(random() % 297), 3, 3);
    const int weak = static_cast<int>(random() % 9);
    Window other;
    std::copy(part.colors.begin(), part.colors.end(), other.begin());
    const CellReading reading = Reading(other[weak], 1.5f);
    other[weak] = static_cast<CellColor>(reading.second);
    if (!index.Find(other)) continue;
    MeasuredPatch patch = Measured(part);
    patch.readings[weak] = reading;
    for (const DecodedPiece& piece : DecodePatch(patch, index)) {
      const bool right = RightCells(patch, piece, part) == 9;
      EXPECT_FLOAT_EQ(piece.margin, right ? 1.5f : -1.5f);
      EXPECT_EQ(Why(piece), "no margin over the runner-up");
      compared += right;
    }
  }
  EXPECT_GE(compared, 2);
}

TEST(PatchDecoder, MirrorsAreSeen) {
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    std::mt19937 random(seed);
    const Picture picture =
        PartOf(PatchBoard(), static_cast<int>(random() % 50), static_cast<int>(random() % 50), 8, 9);
    EXPECT_FALSE(LooksMirrored(Measured(picture), PatchTestIndex()));
    EXPECT_TRUE(LooksMirrored(Measured(Mirrored(picture)), PatchTestIndex()));
    EXPECT_TRUE(LooksMirrored(Measured(Turned(Mirrored(picture))), PatchTestIndex()));
  }
  EXPECT_FALSE(LooksMirrored(Measured(Random(2, 9, 1)), PatchTestIndex())) << "no window at all";
}

TEST(PatchDecoder, PatchesWithHolesAreReadAroundThem) {
  const Picture picture = PartOf(PatchBoard(), 40, 40, 9, 9);
  const MeasuredPatch whole = Measured(picture);
  MeasuredPatch holed = whole;
  holed.lattice.cells.clear();
  holed.readings.clear();
  std::vector<std::optional<BoardCell>> from;
  for (size_t k = 0; k < 81; ++k) {
    holed.grid[k] = -1;
    if (k == 40 || k == 56) continue;
    holed.grid[k] = static_cast<int>(holed.lattice.cells.size());
    holed.lattice.cells.push_back(whole.lattice.cells[k]);
    holed.readings.push_back(whole.readings[k]);
    from.push_back(picture.from[k]);
  }
  // Cells that are in a window without a hole.
  std::set<int> readable;
  for (int window = 0; window < 49; ++window) {
    std::set<int> cells;
    for (int k = 0; k < 9; ++k) cells.insert(holed.grid[(window / 7 + k / 3) * 9 + window % 7 + k % 3]);
    if (!cells.contains(-1)) readable.insert(cells.begin(), cells.end());
  }
  const auto pieces = DecodePatch(holed, PatchTestIndex());
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(std::set<int>(pieces[0].cells.begin(), pieces[0].cells.end()), readable);
  for (const int k : pieces[0].cells) {
    const PatchCell& cell = holed.lattice.cells[k];
    EXPECT_EQ(pieces[0].pose.ToBoard(cell.i, cell.j), *from[k]);
  }
}

TEST(PatchDecoder, CellsAreReadAsBayesSays) {
  const InkModel inks = InkModel::Faded(0.3f, {1, 1, 1});
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 2);
  for (int trial = 0; trial < 200; ++trial) {
    const Rgb color = {uniform(random), uniform(random), uniform(random)};
    const auto likelihoods = inks.Likelihoods(color);
    const CellReading reading = ReadCell(inks, color);
    double sum = 0;
    for (const float p : likelihoods) sum += p;
    auto sorted = likelihoods;
    std::sort(sorted.begin(), sorted.end(), std::greater<>());
    for (int k = 0; k < kCellColors; ++k) {
      EXPECT_NEAR(reading.evidence[k], std::log(kCellColors * likelihoods[k] / sum), 1e-4);
    }
    EXPECT_EQ(likelihoods[reading.best], sorted[0]);
    EXPECT_EQ(likelihoods[reading.second], sorted[1]);
    EXPECT_NE(reading.best, reading.second);
    EXPECT_NEAR(reading.lead, std::log(sorted[0] / sorted[1]), 1e-4);
  }
}

TEST(PatchDecoder, ColoursAreRelativeToTheLightAround) {
  // Light falls off to the right by 4 % a cell; a cell's colour stays what it is.
  constexpr int kSide = 15;
  ColorImage image{10 * kSide, 10 * kSide, PixelVector<uint8_t>(4 * 100 * kSide * kSide, uint8_t{0})};
  LatticePatch lattice;
  lattice.i_max = lattice.j_max = kSide - 1;
  std::vector<Keypoint> points;
  for (int k = 0; k < kSide * kSide; ++k) {
    const int i = k / kSide, j = k % kSide;
    lattice.cells.push_back({i, j, k, 10, 0, 0, 10});
    points.push_back({10.0f * j + 4.5f, 10.0f * i + 4.5f, 1});
    const double light = std::pow(0.96, j);
    for (int pixel = 0; pixel < 100; ++pixel) {
      uint8_t* p = image.row(10 * i + pixel / 10) + 4 * (10 * j + pixel % 10);
      const bool red = (i + j) % 2 == 0;
      p[0] = static_cast<uint8_t>(std::lround(light * (red ? 200 : 100)));
      p[1] = p[2] = static_cast<uint8_t>(std::lround(light * (red ? 50 : 100)));
    }
  }
  const MeasuredPatch patch = MeasurePatch(lattice, points, image);
  for (int i = 4; i < kSide - 4; ++i) {
    for (int j = 4; j < kSide - 4; ++j) {
      const Rgb& color = patch.colors[patch.CellAt(i, j)];
      const bool red = (i + j) % 2 == 0;
      EXPECT_NEAR(color[0], red ? 2.0 : 1.0, 0.06);
      EXPECT_NEAR(color[1], red ? 0.5 : 1.0, 0.06);
    }
  }
  EXPECT_EQ(patch.CellAt(-1, 0), -1);
  EXPECT_EQ(patch.CellAt(0, kSide), -1);
}

TEST(PatchDecoder, WhyRejectedNamesTheFirstLimitThatFails) {
  DecodedPiece piece;
  piece.cells.resize(20);
  piece.evidence = 12;
  piece.margin = 6;
  piece.contradicted = 5;
  EXPECT_EQ(Why(piece), "");
  DecodedPiece other = piece;
  other.contradicted = 6;
  EXPECT_EQ(Why(other), "contradicted by the cells around");
  other.evidence = 30;
  EXPECT_EQ(Why(other), "");
  other.evidence = 29.9f;
  EXPECT_EQ(Why(other), "contradicted by the cells around");
  other.margin = 5.9f;
  EXPECT_EQ(Why(other), "no margin over the runner-up");
  other.evidence = 11.9f;
  EXPECT_EQ(Why(other), "too little evidence");
  LevelPatch mirrored;
  mirrored.mirrored = true;
  EXPECT_EQ(WhyRejected(mirrored, other, {}), "mirrored");
  EXPECT_EQ(WhyRejected({}, piece, {.min_evidence = 13}), "too little evidence");
}

}  // namespace
}  // namespace weft
