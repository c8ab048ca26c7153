#include "pattern/seeds/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "tests/pattern/seeds/drawn_sheets.h"

namespace weft {
namespace {

enum class Judged { kAll, kFramed };

// Cells of the patch that no quarter turn and move of one sheet explains: 0 where all were joined rightly.
int JoinedWrongly(const Scene& scene, const LatticePatch& patch, Judged judged = Judged::kAll) {
  const auto counts = [&](const PatchCell& cell) { return judged == Judged::kAll || cell.has_frame(); };
  const auto total = std::count_if(patch.cells.begin(), patch.cells.end(), counts);
  std::ptrdiff_t best = 0;
  for (const PatchCell& first : patch.cells) {
    const Origin& at = scene.OriginOf(first);
    if (at.sheet < 0 || !counts(first)) continue;
    for (int turn = 0; turn < 4; ++turn) {
      constexpr std::array<int, 4> kCos = {1, 0, -1, 0}, kSin = {0, 1, 0, -1};
      std::ptrdiff_t right = 0;
      for (const PatchCell& cell : patch.cells) {
        if (!counts(cell)) continue;
        const int di = cell.i - first.i, dj = cell.j - first.j;
        const Origin& other = scene.OriginOf(cell);
        right += other.sheet == at.sheet && other.row == at.row + kCos[turn] * di + kSin[turn] * dj &&
                 other.col == at.col - kSin[turn] * di + kCos[turn] * dj;
      }
      best = std::max(best, right);
    }
    if (2 * best > total) break;
  }
  return static_cast<int>(total - best);
}

size_t CellsIn(const std::vector<LatticePatch>& patches) {
  size_t cells = 0;
  for (const LatticePatch& patch : patches) cells += patch.cells.size();
  return cells;
}

// One patch of the whole sheet, its extent as of rows and columns, every keypoint once.
void ExpectWhole(const Scene& scene, const Sheet& sheet, const std::string& about) {
  const auto patches = scene.Build();
  ASSERT_EQ(patches.size(), 1u) << about;
  const LatticePatch& patch = patches[0];
  EXPECT_EQ(patch.cells.size(), scene.size()) << about;
  EXPECT_EQ(JoinedWrongly(scene, patch), 0) << about;
  std::set<std::pair<int, int>> places;
  std::set<int> keypoints;
  for (const PatchCell& cell : patch.cells) {
    places.insert({cell.i, cell.j});
    keypoints.insert(cell.keypoint);
    EXPECT_TRUE(cell.i >= patch.i_min && cell.i <= patch.i_max && cell.j >= patch.j_min &&
                cell.j <= patch.j_max);
  }
  EXPECT_EQ(places.size(), patch.cells.size()) << about;
  EXPECT_EQ(keypoints.size(), patch.cells.size()) << about;
  const int tall = patch.i_max - patch.i_min + 1, wide = patch.j_max - patch.j_min + 1;
  EXPECT_EQ(std::max(tall, wide), std::max(sheet.rows, sheet.cols)) << about;
  EXPECT_EQ(std::min(tall, wide), std::min(sheet.rows, sheet.cols)) << about;
}

TEST(Lattice, JoinsAWholeSheetUnderAnyTurn) {
  for (int angle_deg = 0; angle_deg < 360; angle_deg += 12) {
    for (const double pitch_px : {3.0, 5.0, 6.5}) {
      const Sheet sheet =
          MovedTo(80.3, 79.6, Turned({.ax = pitch_px, .by = pitch_px}, angle_deg + 0.7 * pitch_px));
      ExpectWhole(Scene({sheet}), sheet,
                  std::to_string(angle_deg) + " degrees, pitch " + std::to_string(pitch_px));
    }
  }
}

TEST(Lattice, JoinsSheetsThatAreShearedOrSqueezed) {
  for (const double angle_deg : {0.0, 33.0, 71.0, 128.0}) {
    for (const double shear : {-0.6, -0.3, 0.3, 0.6}) {
      const Sheet sheet = MovedTo(80, 80, Turned({.bx = 5 * shear}, angle_deg));
      ExpectWhole(Scene({sheet}), sheet, "shear " + std::to_string(shear));
    }
    for (const double squeeze : {0.4, 0.6, 0.8}) {
      const Sheet sheet = MovedTo(80, 80, Turned({.ax = 7.5 * squeeze, .by = 7.5}, angle_deg));
      ExpectWhole(Scene({sheet}), sheet, "squeezed to " + std::to_string(squeeze));
    }
  }
}

TEST(Lattice, FramesAreTheEdgesOfTheSheet) {
  const Sheet sheet = MovedTo(80, 80, Turned({.ax = 4, .ay = 0.6, .bx = -1, .by = 6}, 25));
  const Scene scene({sheet});
  const auto patches = scene.Build();
  ASSERT_EQ(patches.size(), 1u);
  int framed = 0;
  for (const PatchCell& cell : patches[0].cells) {
    const Origin& at = scene.OriginOf(cell);
    const bool border = at.row == 0 || at.col == 0 || at.row == sheet.rows - 1 || at.col == sheet.cols - 1;
    EXPECT_EQ(cell.has_frame(), !border) << at.row << " " << at.col;
    if (!cell.has_frame()) continue;
    ++framed;
    EXPECT_GT(cell.ax * cell.by - cell.ay * cell.bx, 0) << "right-handed";
    for (const PatchCell& other : patches[0].cells) {
      const auto expect_at = [&](float dx, float dy) {
        const Origin& there = scene.OriginOf(other);
        const auto [x, y] = sheet.Pixel(there.row - at.row, there.col - at.col);
        EXPECT_NEAR(dx, x - sheet.x, 1e-3);
        EXPECT_NEAR(dy, y - sheet.y, 1e-3);
      };
      if (other.i == cell.i && other.j == cell.j + 1) expect_at(cell.ax, cell.ay);
      if (other.i == cell.i + 1 && other.j == cell.j) expect_at(cell.bx, cell.by);
    }
  }
  EXPECT_EQ(framed, (sheet.rows - 2) * (sheet.cols - 2));
}

TEST(Lattice, MissingPointsLeaveHolesAndNoWrongJoins) {
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    const Sheet sheet = MovedTo(80, 80, Turned({.rows = 18, .cols = 18}, 31.0 * seed));
    Scene scene({sheet});
    scene.Jitter(0.15, seed);
    scene.Drop(0.06, seed + 100);
    const auto patches = scene.Build();
    for (const LatticePatch& patch : patches) EXPECT_EQ(JoinedWrongly(scene, patch), 0) << "seed " << seed;
    EXPECT_GE(static_cast<double>(CellsIn(patches)), 0.85 * static_cast<double>(scene.size()))
        << "seed " << seed;
  }
}

TEST(Lattice, SpuriousPointsAreLeftOut) {
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    const Sheet sheet = MovedTo(80, 80, Turned({.rows = 18, .cols = 18}, 31.0 * seed));
    Scene scene({sheet});
    scene.Jitter(0.1, seed);
    scene.AddSpurious(60, seed + 200);
    const auto patches = scene.Build();
    size_t largest = 0;
    for (const LatticePatch& patch : patches) {
      EXPECT_LE(JoinedWrongly(scene, patch), 2)
          << "seed " << seed << ", a spurious point near a missing cell";
      largest = std::max(largest, patch.cells.size());
    }
    EXPECT_GE(largest, size_t{18 * 18 * 8 / 10}) << "seed " << seed;
  }
}

TEST(Lattice, PiecesApartStayApart) {
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    // The gap is half a cell wider than a cell, so that rows could go on across it; then the second piece is
    // moved along it, and turned a little.
    const double angle_deg = 29.0 * seed, moved = 0.1 * (seed % 10);
    Sheet left = Turned({.rows = 12, .cols = 8}, angle_deg), right = left;
    left = MovedTo(80, 80, left);
    left.x -= 4.5 * left.ax;
    left.y -= 4.5 * left.ay;
    const auto [x, y] = left.Pixel(moved, 8 + 1.5);
    right = Turned(right, seed % 3);
    right.x = x;
    right.y = y;
    Scene scene({left, right});
    scene.Jitter(0.1, seed);
    const auto patches = scene.Build();
    for (const LatticePatch& patch : patches) EXPECT_EQ(JoinedWrongly(scene, patch), 0) << "seed " << seed;
    EXPECT_EQ(CellsIn(patches), scene.size()) << "seed " << seed;
    EXPECT_EQ(patches.size(), 2u) << "seed " << seed;
  }
}

TEST(Lattice, PiecesThatTouchAcrossAFoldAreNotMixed) {
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    Sheet left = MovedTo(80, 80, {.rows = 14, .cols = 8});
    left.x -= 22;
    // The next column is where a column would be, but half a row lower.
    Sheet right = left;
    std::tie(right.x, right.y) = left.Pixel(0.5, 8);
    Scene scene({left, right});
    scene.Jitter(0.1, seed);
    for (const LatticePatch& patch : scene.Build()) {
      EXPECT_EQ(JoinedWrongly(scene, patch, Judged::kFramed), 0) << "seed " << seed;
      // Cells at the fold have neighbours on three sides, and may go with the wrong ones.
      EXPECT_LE(JoinedWrongly(scene, patch), left.rows) << "seed " << seed;
    }
  }
}

TEST(Lattice, StripsNeedThreeCells) {
  for (const double angle_deg : {0.0, 20.0, 65.0, 100.0}) {
    for (const int width : {1, 2}) {
      const Scene scene({MovedTo(80, 80, Turned({.rows = width, .cols = 20}, angle_deg))});
      EXPECT_TRUE(scene.Build().empty()) << width << " wide";
    }
    const Sheet sheet = MovedTo(80, 80, Turned({.rows = 3, .cols = 20}, angle_deg));
    ExpectWhole(Scene({sheet}), sheet, "3 wide");
    const Sheet cross = MovedTo(80, 80, Turned({.rows = 3, .cols = 3}, angle_deg));
    ExpectWhole(Scene({cross}), cross, "a single window");
  }
}

TEST(Lattice, SpotsWithoutInkBetweenAreNoCells) {
  Scene scene({MovedTo(80, 80, {})});
  scene.RemoveInk();
  EXPECT_TRUE(scene.Build().empty());
}

TEST(Lattice, FramesHaveInkOnAllSides) {
  for (const double angle_deg : {0.0, 40.0, 130.0, 220.0, 310.0}) {
    Scene scene({MovedTo(80, 80, Turned({}, angle_deg))});
    scene.RemoveInkRightOf(6);
    int framed = 0;
    for (const LatticePatch& patch : scene.Build()) {
      EXPECT_EQ(JoinedWrongly(scene, patch), 0);
      for (const PatchCell& cell : patch.cells) {
        if (!cell.has_frame()) continue;
        ++framed;
        EXPECT_NE(scene.OriginOf(cell).col, 6) << angle_deg;
        EXPECT_NE(scene.OriginOf(cell).col, 7) << angle_deg;
      }
    }
    EXPECT_EQ(framed, 10 * 10);
  }
}

TEST(Lattice, WhatIsFarFromRegularIsTakenOnceAtMost) {
  size_t joined = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Scene scene({MovedTo(80, 80, Turned({.rows = 20, .cols = 20}, 17.0 * seed))});
    scene.Jitter(0.6, seed);
    scene.AddSpurious(150, seed + 50);
    std::set<int> keypoints;
    for (const LatticePatch& patch : scene.Build()) {
      std::set<std::pair<int, int>> places;
      for (const PatchCell& cell : patch.cells) {
        EXPECT_TRUE(keypoints.insert(cell.keypoint).second);
        EXPECT_TRUE(places.insert({cell.i, cell.j}).second);
      }
    }
    joined += keypoints.size();
  }
  EXPECT_GT(joined, 2000u);
}

// Cells whose pitch changes from one to the next by half are not of one piece of cloth.
TEST(Lattice, FramesThatDisagreeAreNotJoined) {
  for (const double turn_deg : {0.0, 90.0, 180.0, 270.0}) {
    const Sheet fine = MovedTo(60, 80, Turned({.ax = 4, .by = 6, .rows = 9, .cols = 9}, turn_deg));
    Sheet wide = fine;
    wide.ax *= 1.9;
    wide.ay *= 1.9;
    std::tie(wide.x, wide.y) = fine.Pixel(0, 9.45);
    const Scene scene({fine, wide});
    for (const LatticePatch& patch : scene.Build())
      EXPECT_EQ(JoinedWrongly(scene, patch, Judged::kFramed), 0) << turn_deg;
  }
}

TEST(Lattice, RandomPointsAreNoLattice) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    Scene scene({});
    scene.AddSpurious(600, seed);
    for (const LatticePatch& patch : scene.Build()) EXPECT_LT(patch.cells.size(), 9u) << "seed " << seed;
  }
}

TEST(Lattice, OptionsBoundWhatIsJoined) {
  const Scene squeezed({MovedTo(80, 80, {.ax = 2.5, .by = 7.5})});
  EXPECT_FALSE(squeezed.Build().empty());
  // Every third point of the short rows makes a lattice that is nearly square.
  for (const LatticePatch& patch : squeezed.Build({.max_stretch = 2.5f})) {
    for (const PatchCell& cell : patch.cells) {
      const float a = std::hypot(cell.ax, cell.ay), b = std::hypot(cell.bx, cell.by);
      EXPECT_LE(std::max(a, b), 2.5f * std::min(a, b));
    }
  }
  const Scene stretched({MovedTo(80, 80, {.ax = 2.5, .by = 9.5})});
  EXPECT_TRUE(stretched.Build({.max_stretch = 5}).empty()) << "edges beyond 9 px belong to a smaller image";
}

}  // namespace
}  // namespace weft
