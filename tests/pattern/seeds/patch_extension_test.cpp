#include "pattern/seeds/patch_extension.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace weft {
namespace {

constexpr int kPictureSide = 200;

std::vector<ColorImage> GreyPyramid() {
  std::vector<ColorImage> pyramid;
  for (const int side : {kPictureSide, kPictureSide / 2})
    pyramid.push_back({side, side, PixelVector<uint8_t>(static_cast<size_t>(4 * side * side), uint8_t{90})});
  return pyramid;
}

// A strip that bends, its columns closer to each other at the sides: the place of a cell.
std::pair<float, float> At(int row, int col, float x) {
  const float across = 5 * std::sin(0.45f * static_cast<float>(col - 1)) / 0.45f;
  return {x + across + 6 * std::sin(0.05f * static_cast<float>(row)), 10 + 4.5f * static_cast<float>(row)};
}

struct Strip {
  int rows, cols;
  float x;
};

// Blobs of strips, and of each a patch of one cell with a frame, which is (0, 0) there.
struct ExtensionScene {
  std::vector<LooseBlob> blobs;
  std::vector<BoardCell> cells;  // of the blobs
  std::vector<LevelPatch> patches;

  ExtensionScene(const std::vector<Strip>& strips, int level = 0) {
    for (const Strip& strip : strips) {
      for (int row = 0; row < strip.rows; ++row) {
        for (int col = 0; col < strip.cols; ++col) {
          const auto [x, y] = At(row, col, strip.x);
          blobs.push_back({x, y, level});
          cells.push_back({row, col});
        }
      }
      LevelPatch patch;
      patch.level = level;
      patch.scale = static_cast<float>(1 << level);
      const auto [x, y] = At(strip.rows / 2, 1, strip.x);
      patch.points.push_back({x, y, 0});
      patch.measured.lattice.cells.push_back({0, 0, 0, 5 / patch.scale, 0, 0, 4.5f / patch.scale});
      patches.push_back(patch);
    }
  }

  // Cells of a patch that are at (i, j) as the first of them says.
  int RightCells(const LevelPatch& patch, int middle_row) const {
    int right = 0;
    for (size_t k = 0; k < patch.points.size(); ++k) {
      for (size_t b = 0; b < blobs.size(); ++b) {
        if (blobs[b].x_px != patch.points[k].x_px || blobs[b].y_px != patch.points[k].y_px) continue;
        const PatchCell& c = patch.measured.lattice.cells[k];
        right += cells[b].row == middle_row + c.i && cells[b].col == 1 + c.j;
      }
    }
    return right;
  }
};

TEST(ExtendPatches, FollowsABentStripFromOneFrame) {
  for (const int level : {0, 1}) {
    const ExtensionScene scene({{36, 3, 60}}, level);
    const auto extended = ExtendPatches(GreyPyramid(), scene.patches, scene.blobs);
    ASSERT_EQ(extended.size(), 1u);
    EXPECT_EQ(extended[0].points.size(), 108u);
    EXPECT_EQ(scene.RightCells(extended[0], 18), 108);
    EXPECT_TRUE(extended[0].is_strip);
    EXPECT_EQ(extended[0].level, level);
    const LatticePatch& lattice = extended[0].measured.lattice;
    EXPECT_EQ(std::pair(lattice.i_min, lattice.i_max), std::pair(-18, 17));
    EXPECT_EQ(std::pair(lattice.j_min, lattice.j_max), std::pair(-1, 1));
    for (const PatchCell& c : lattice.cells) {
      // Along the rows they bend, along the columns they are as far apart as they were.
      EXPECT_NEAR(c.by * extended[0].scale, 4.5f, 0.01f);
      EXPECT_GT(c.ax * extended[0].scale, 4);
    }
  }
}

TEST(ExtendPatches, FramesOfTwoStepsAreHalved) {
  ExtensionScene scene({{36, 3, 60}});
  PatchCell& start = scene.patches[0].measured.lattice.cells[0];
  start.by *= 2;
  const auto extended = ExtendPatches(GreyPyramid(), scene.patches, scene.blobs);
  ASSERT_EQ(extended.size(), 1u);
  EXPECT_EQ(scene.RightCells(extended[0], 18), 108);
}

TEST(ExtendPatches, FramesThatLeadNowhereTakeNothing) {
  ExtensionScene scene({{36, 3, 60}});
  // The first patch has a frame askew, from which hardly any cell follows.
  LevelPatch askew = scene.patches[0];
  askew.measured.lattice.cells[0].ax = 3;
  askew.measured.lattice.cells[0].ay = 3;
  askew.measured.lattice.cells[0].bx = -3;
  askew.measured.lattice.cells[0].by = 2;
  scene.patches.insert(scene.patches.begin(), askew);
  const auto extended = ExtendPatches(GreyPyramid(), scene.patches, scene.blobs);
  ASSERT_EQ(extended.size(), 1u);
  EXPECT_EQ(scene.RightCells(extended[0], 18), 108);
}

TEST(ExtendPatches, ABlobJoinsOnePatchOfItsLevel) {
  const ExtensionScene near({{36, 3, 60}, {36, 3, 75}, {36, 3, 120}});
  std::map<std::pair<float, float>, int> joined;
  for (const LevelPatch& patch : ExtendPatches(GreyPyramid(), near.patches, near.blobs)) {
    for (const Keypoint& p : patch.points) ++joined[{p.x_px, p.y_px}];
  }
  EXPECT_EQ(joined.size(), near.blobs.size());
  for (const auto& [point, times] : joined) EXPECT_EQ(times, 1);
  ExtensionScene other({{36, 3, 60}});
  for (LooseBlob& blob : other.blobs) blob.level = 1;
  EXPECT_TRUE(ExtendPatches(GreyPyramid(), other.patches, other.blobs).empty());
}

TEST(ExtendPatches, NothingStartsFromCellsThatAreKnown) {
  ExtensionScene scene({{36, 3, 60}});
  const Keypoint start = scene.patches[0].points[0];
  std::erase_if(scene.blobs,
                [&](const LooseBlob& blob) { return blob.x_px == start.x_px && blob.y_px == start.y_px; });
  EXPECT_TRUE(ExtendPatches(GreyPyramid(), scene.patches, scene.blobs).empty());
}

TEST(ExtendPatches, BlobsFarFromTheirPlaceAreLeftOut) {
  ExtensionScene scene({{36, 3, 60}});
  for (size_t b = 0; b < scene.blobs.size(); ++b) {
    if (scene.cells[b].row == 25) scene.blobs[b].y_px += 1.5f;  // a third of a cell
  }
  const auto extended = ExtendPatches(GreyPyramid(), scene.patches, scene.blobs);
  ASSERT_EQ(extended.size(), 1u);
  EXPECT_EQ(extended[0].points.size(), 75u) << "25 rows";
}

TEST(ExtendPatches, SmallPatchesAreLeftOut) {
  EXPECT_EQ(
      ExtendPatches(GreyPyramid(), ExtensionScene({{4, 3, 60}}).patches, ExtensionScene({{4, 3, 60}}).blobs)
          .size(),
      1u);
  EXPECT_TRUE(
      ExtendPatches(GreyPyramid(), ExtensionScene({{3, 3, 60}}).patches, ExtensionScene({{3, 3, 60}}).blobs)
          .empty());
}

}  // namespace
}  // namespace weft
