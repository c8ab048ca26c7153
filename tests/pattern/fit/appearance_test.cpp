#include "pattern/fit/appearance.h"

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

const std::vector<float> kSigmasPx = {0.4f, 0.55f, 0.7f, 0.85f, 1.0f, 1.2f, 1.5f, 1.9f, 2.4f};

class AppearanceTest : public ::testing::Test {
 protected:
  Appearance Calibrate(const Photograph& photo, const Appearance& start, double misplaced_cells = 0) {
    std::vector<PlacedCell> cells = TrueCells(photo, board_, 1.5, 3);
    std::mt19937 random(photo.seed);
    std::uniform_real_distribution<float> off(-static_cast<float>(misplaced_cells),
                                              static_cast<float>(misplaced_cells));
    for (PlacedCell& cell : cells) {
      cell.pose.x += off(random) * static_cast<float>(photo.pitch_px);
      cell.pose.y += off(random) * static_cast<float>(photo.pitch_px);
    }
    EXPECT_GE(cells.size(), 40u);
    const int levels = photo.pitch_px > 7.5 ? 2 : 1;
    return CalibrateAppearance(
        {HalvingsOf(Render(photo, board_), levels), board_, SampledProfile(board_.square_fraction)}, cells,
        kSigmasPx, start);
  }

  // Grey, as nothing is known of the inks.
  static Appearance Grey() {
    Appearance start;
    for (Rgb& ink : start.inks) ink = {100, 100, 100};
    start.black = {25, 25, 25};
    return start;
  }

  // Inks above the lines, relative to the mean of all: neither light nor an offset changes these.
  static std::vector<double> Relative(const Appearance& appearance) {
    std::vector<double> relative;
    double mean = 0;
    for (const Rgb& ink : appearance.inks) {
      for (int c = 0; c < 3; ++c) {
        relative.push_back(ink[c] - appearance.black[c]);
        mean += relative.back() / (3 * kCellColors);
      }
    }
    for (double& value : relative) value /= mean;
    return relative;
  }

  static void ExpectInks(const Photograph& photo, const Appearance& found, double tolerance) {
    const auto truth = Relative(TrueAppearance(photo)), relative = Relative(found);
    for (size_t k = 0; k < truth.size(); ++k)
      EXPECT_NEAR(relative[k], truth[k], tolerance) << "ink " << k / 3 << " channel " << k % 3;
  }

  const Board board_ = *GenerateBoard(50, 50, 3, 5);
};

TEST_F(AppearanceTest, RecoversInksFromGrey) {
  for (const double fade : {0.1, 0.5}) {
    for (const double pitch_px : {5.0, 7.0}) {
      const Photograph photo{.width_px = 120, .height_px = 110, .pitch_px = pitch_px, .fade = fade};
      const Appearance found = Calibrate(photo, Grey());
      ExpectInks(photo, found, 0.05);
      // The lines are black of 12 % in the light, and 6 grey levels on all.
      double mean = 0;
      for (const Rgb& ink : found.inks) mean += (ink[0] + ink[1] + ink[2]) / (3 * kCellColors);
      EXPECT_GT(found.black[0], 0);
      EXPECT_LT(found.black[0], 0.5 * mean);
    }
  }
}

TEST_F(AppearanceTest, KeepsTheMeanOfTheInksItStartsFrom) {
  const Photograph photo{.width_px = 110, .height_px = 100, .pitch_px = 5};
  for (const float scale : {0.5f, 1.7f}) {
    Appearance start = Grey();
    for (Rgb& ink : start.inks) {
      for (float& channel : ink) channel *= scale;
    }
    const Appearance found = Calibrate(photo, start);
    double mean = 0;
    for (const Rgb& ink : found.inks) mean += (ink[0] + ink[1] + ink[2]) / (3 * kCellColors);
    EXPECT_NEAR(mean, 100 * scale, 0.01 * scale * 100);
    ExpectInks(photo, found, 0.05);
  }
}

TEST_F(AppearanceTest, RecoversTheBlur) {
  struct Case {
    double blur_px, pitch_px;
  };
  for (const Case& c : {Case{0.5, 5}, {0.8, 5}, {0.8, 8}, {1.15, 6}, {1.5, 6}, {1.9, 9}}) {
    const Photograph photo{
        .width_px = 130, .height_px = 120, .pitch_px = c.pitch_px, .bend_cells = 0.3, .blur_px = c.blur_px};
    const double truth = TrueAppearance(photo).sigma_px, found = Calibrate(photo, Grey()).sigma_px;
    // Within a step of what is tried.
    EXPECT_NEAR(std::log(found / truth), 0, 0.22) << "blur " << c.blur_px << " at " << c.pitch_px << " px";
  }
}

TEST_F(AppearanceTest, CellsThatAreALittleOffDoNoHarm) {
  const Photograph photo{.width_px = 130, .height_px = 120, .pitch_px = 6};
  const Appearance found = Calibrate(photo, Grey(), 0.06);
  ExpectInks(photo, found, 0.08);
  EXPECT_NEAR(found.sigma_px, TrueAppearance(photo).sigma_px, 0.26);
}

TEST_F(AppearanceTest, WithoutCellsNothingChanges) {
  const Photograph photo{.width_px = 40, .height_px = 40};
  const Appearance start = Grey();
  const Appearance found = CalibrateAppearance(
      {HalvingsOf(Render(photo, board_), 1), board_, SampledProfile(board_.square_fraction)},
      std::vector<PlacedCell>(), kSigmasPx, start);
  EXPECT_EQ(found.inks, start.inks);
  EXPECT_EQ(found.black, start.black);
}

// In narrow strips what is beside a cell is something else.
TEST_F(AppearanceTest, HiddenNeighboursDoNotCount) {
  const Photograph photo{.width_px = 300, .height_px = 300, .pitch_px = 6, .blur_px = 0.8};
  Frame strips = Render(photo, board_);
  auto bytes = std::make_shared<std::vector<uint8_t>>(*strips.pixels);
  for (int k = 0; k < photo.width_px * photo.height_px; ++k) {
    const double u = BoardFromPixel(photo, board_, k % photo.width_px, k / photo.width_px).first;
    if (std::fmod(u, 6.0) > 2) std::fill_n(bytes->begin() + 3 * k, 3, uint8_t{250});
  }
  strips.pixels = bytes;
  const PrintedView view{HalvingsOf(strips, 1), board_, SampledProfile(board_.square_fraction)};
  std::vector<PredictedCell> cells;
  for (const PlacedCell& cell : TrueCells(photo, board_, 2)) {
    if (cell.col % 6 >= 2) continue;
    cells.push_back({.row = cell.row, .col = cell.col, .pose = cell.pose});
    for (int k = 0; k < 9; ++k) cells.back().in_sight[k] = (cell.col + k % 3 - 1 + 6) % 6 < 2 ? 1.0f : 0.0f;
  }
  ASSERT_GE(cells.size(), 100u);
  const Appearance found = CalibrateAppearance(view, cells, kSigmasPx, Grey());
  ExpectInks(photo, found, 0.15);
  EXPECT_NEAR(found.sigma_px, photo.blur_px, 0.16);
  // Else the white cloth beside them would.
  for (PredictedCell& cell : cells) cell.in_sight.fill(1);
  const auto truth = Relative(TrueAppearance(photo)),
             wrong = Relative(CalibrateAppearance(view, cells, kSigmasPx, Grey()));
  double largest = 0;
  for (size_t k = 0; k < truth.size(); ++k) largest = std::max(largest, std::abs(wrong[k] - truth[k]));
  EXPECT_GT(largest, 0.2);
}

}  // namespace
}  // namespace weft
