#include "pattern/fit/view_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "tests/pattern/fit/true_cells.h"

namespace weft {
namespace {

TEST(ModelNoise, IsThatOfThePrintInWellExposedPictures) {
  for (const float gain : {0.8f, 1.0f, 1.4f})
    for (const float residual : {1.0f, 5.0f, 8.0f}) EXPECT_EQ(ModelNoise(gain, residual), kModelNoise);
}

TEST(ModelNoise, FollowsTheLight) {
  const float half = ModelNoise(0.3f, 1);
  EXPECT_LT(half, kModelNoise);
  EXPECT_NEAR(ModelNoise(0.15f, 0.5f), half / 2, 1e-5);
  EXPECT_GT(ModelNoise(0, 0), 0);
}

// Residuals of interpolated pixels: the mean of the squares of the weights of linear interpolation is 2/3 an
// axis.
TEST(ModelNoise, AddsTheNoiseOfPixels) {
  for (const double noise : {4.0, 12.0, 40.0}) {
    const double seen = std::sqrt(kModelNoise * kModelNoise + 4.0 / 9 * noise * noise);
    EXPECT_NEAR(ModelNoise(1, static_cast<float>(seen)), std::hypot(kModelNoise, noise), 1e-3);
  }
}

// Of a photograph without what a print's model gets wrong, residuals are noise.
TEST(ModelNoise, IsFoundInAView) {
  const Board board = *GenerateBoard(60, 60, 3, 5);
  for (const double noise : {1.0, 20.0, 30.0}) {
    const Photograph photo{.bend_cells = 0.1, .noise = noise};
    const std::vector<ColorImage> pyramid = HalvingsOf(Render(photo, board), 1);
    const SampledProfile profile(board.square_fraction);
    const CellFitter fitter(pyramid, board, profile, TrueAppearance(photo));
    std::vector<PredictedCell> cells;
    for (const PlacedCell& cell : TrueCells(photo, board, 2, 3)) {
      cells.push_back({.row = cell.row, .col = cell.col, .pose = cell.pose});
      cells.back().in_sight.fill(1);
    }
    const double found = ModelNoiseOf(fitter, cells);
    if (noise < 2) {
      EXPECT_EQ(found, kModelNoise);
    } else {
      EXPECT_NEAR(found, noise, 0.2 * noise);
    }
  }
}

TEST(ModelNoise, WithoutCellsIsThatOfThePrint) {
  const Board board = *GenerateBoard(20, 20, 3, 5);
  const Photograph photo{.width_px = 60, .height_px = 60};
  const std::vector<ColorImage> pyramid = HalvingsOf(Render(photo, board), 1);
  const SampledProfile profile(board.square_fraction);
  const CellFitter fitter(pyramid, board, profile, TrueAppearance(photo));
  EXPECT_EQ(ModelNoiseOf(fitter, {}), kModelNoise);
}

}  // namespace
}  // namespace weft
