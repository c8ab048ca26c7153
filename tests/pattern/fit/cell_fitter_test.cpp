#include "pattern/fit/cell_fitter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "tests/pattern/fit/fitting.h"

namespace weft {
namespace {

constexpr int kIterations = 6;

double DistancePx(const CellFrame& f, const CellFrame& g) { return std::hypot(f.x - g.x, f.y - g.y); }

// Moved by up to a share of a cell, and its edges changed by up to another.
CellFrame Disturbed(const CellFrame& f, float move, float shape, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const float u = move * uniform(random), v = move * uniform(random), stretch = 1 + shape * uniform(random),
              shear = shape * uniform(random);
  return {f.x + u * f.ax + v * f.bx, f.y + u * f.ay + v * f.by, stretch * f.ax, stretch * f.ay,
          f.bx + shear * f.ax,       f.by + shear * f.ay};
}

TEST(CellFitter, RecoversThePoseFromAQuarterOfACellAway) {
  std::mt19937 random(1);
  for (const double pitch_px : {4.0, 6.0, 9.0, 14.0}) {
    const Photograph photo{.width_px = static_cast<int>(18 * pitch_px),
                           .height_px = static_cast<int>(16 * pitch_px),
                           .pitch_px = pitch_px,
                           .angle_deg = 20 + 50 * pitch_px,
                           .bend_cells = 0.1,
                           .noise = 0.5};
    const Fitting fitting(photo, TestBoard());
    double squares = 0, edge_squares = 0, n = 0;
    for (const PlacedCell& cell : fitting.Cells(2)) {
      const CellFrame start = Disturbed(cell.frame, 0.25f, 0.06f, random);
      const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, start, kAll, kIterations);
      ASSERT_TRUE(fit.converged) << cell.row << " " << cell.col;
      EXPECT_LT(DistancePx(fit.frame, cell.frame), 0.05 * pitch_px) << cell.row << " " << cell.col;
      EXPECT_GT(fit.explained, 0.95);
      EXPECT_GT(fit.gain, 0.6);
      EXPECT_LT(fit.gain, 1.5);
      squares += std::pow(DistancePx(fit.frame, cell.frame), 2);
      edge_squares += std::pow(fit.frame.ax - cell.frame.ax, 2) + std::pow(fit.frame.by - cell.frame.by, 2);
      ++n;
    }
    ASSERT_GT(n, 50);
    EXPECT_LT(std::sqrt(squares / (2 * n)), 0.008 * pitch_px) << "pitch " << pitch_px;
    EXPECT_LT(std::sqrt(edge_squares / (2 * n)), 0.03 * pitch_px) << "pitch " << pitch_px;
  }
}

TEST(CellFitter, SigmaIsTrueOverTheNoise) {
  // Squared errors in units of sigma_px; the decoder multiplies sigma_px for what a real print adds.
  std::map<double, double> sigma_at_less_noise;  // by pitch
  for (const double noise : {4.0, 12.0}) {
    for (const double pitch_px : {4.5, 6.5, 12.0}) {
      double ratios = 0, sigmas = 0, n = 0;
      for (uint32_t seed = 1; seed <= 3; ++seed) {
        const Photograph photo{.width_px = static_cast<int>(16 * pitch_px),
                               .height_px = static_cast<int>(15 * pitch_px),
                               .pitch_px = pitch_px,
                               .bend_cells = 0.05,
                               .noise = noise,
                               .seed = seed};
        const Fitting fitting(photo, TestBoard());
        for (const PlacedCell& cell : fitting.Cells(2)) {
          const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations);
          if (!fit.converged) continue;
          ratios += std::pow(DistancePx(fit.frame, cell.frame) / fit.sigma_px, 2) / 2;
          sigmas += fit.sigma_px;
          ++n;
        }
      }
      ASSERT_GT(n, 150);
      const double ratio = std::sqrt(ratios / n);
      EXPECT_GT(ratio, 0.75) << "noise " << noise << " pitch " << pitch_px;
      EXPECT_LT(ratio, 1.2) << "noise " << noise << " pitch " << pitch_px;
      // Three times the noise, rounding to grey levels and an imperfect render aside.
      if (noise > 4) {
        EXPECT_GT(sigmas / n, 1.5 * sigma_at_less_noise[pitch_px]);
      }
      sigma_at_less_noise[pitch_px] = sigmas / n;
    }
  }
}

TEST(CellFitter, RejectsOtherCellsEarlyAndRightOnesNever) {
  const Photograph photo{.width_px = 120, .height_px = 110, .bend_cells = 0.2};
  const Fitting fitting(photo, TestBoard());
  std::mt19937 random(3);
  constexpr float kLeast = 0.5f;
  int wrong = 0, rejected = 0;
  for (const PlacedCell& cell : fitting.Cells(3)) {
    const CellFrame start = Disturbed(cell.frame, 0.15f, 0.03f, random);
    const CellFit free = fitting.fitter().Fit(cell.row, cell.col, start, kAll, kIterations);
    const CellFit limited = fitting.fitter().Fit(cell.row, cell.col, start, kAll, kIterations, kLeast);
    EXPECT_TRUE(limited.converged);
    EXPECT_EQ(limited.frame.x, free.frame.x);
    EXPECT_EQ(limited.explained, free.explained);
    const int row = (cell.row + 23) % TestBoard().rows, col = (cell.col + 31) % TestBoard().cols;
    const CellFit other = fitting.fitter().Fit(row, col, start, kAll, kIterations, kLeast);
    const CellFit to_the_end = fitting.fitter().Fit(row, col, start, kAll, kIterations);
    ++wrong;
    rejected += !other.converged;
    // What is let go would not have come to the limit.
    if (!other.converged && to_the_end.converged) {
      EXPECT_LT(to_the_end.explained, kLeast);
    }
  }
  EXPECT_GE(rejected, 0.6 * wrong);
}

TEST(CellFitter, InksAreComparedOnTheCellItself) {
  const Photograph photo{.width_px = 120, .height_px = 110, .bend_cells = 0.2};
  const Frame frame = Render(photo, TestBoard());
  const Fitting fitting(photo, TestBoard(), frame);
  for (const PlacedCell& cell : fitting.Cells(5)) {
    const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations);
    // The right ink fits as well as can be: any other changes what it changes.
    const float squared = fit.center_contrast * fit.center_contrast;
    EXPECT_GT(fit.ink_lead, 0.5f * squared);
    EXPECT_LT(fit.ink_lead, 1.6f * squared);
    // The same place, read with another ink in the middle.
    Board changed = TestBoard();
    CellColor& ink = changed.cells[static_cast<size_t>(cell.row) * changed.cols + cell.col];
    ink = static_cast<CellColor>((static_cast<int>(ink) + 3) % kCellColors);
    const Fitting other(photo, changed, frame);
    EXPECT_LT(other.fitter().Fit(cell.row, cell.col, cell.frame, kAll, 1).ink_lead, 0);
  }
}

// Grey from 0.1 cells to the right of the cells' middles on, in every cell's own picture.
TEST(CellFitter, WhatIsMaskedDoesNotCount) {
  const Photograph photo{
      .width_px = 130, .height_px = 120, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0, .noise = 1};
  const Frame frame = Render(photo, TestBoard());
  double with_mask = 0, without = 0, n = 0;
  for (const PlacedCell& cell : TrueCells(photo, TestBoard(), 2, 9)) {
    Frame covered = frame;
    auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
    const int first = static_cast<int>(std::ceil(cell.frame.x + 0.1f * cell.frame.ax));
    for (int y = 0; y < frame.height_px; ++y)
      std::fill_n(&(*pixels)[3 * (static_cast<size_t>(y) * frame.width_px + first)],
                  3 * (frame.width_px - first), 160);
    covered.pixels = pixels;
    const Fitting fitting(photo, TestBoard(), covered);
    SampleMask mask;
    for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) mask.weights[k] = k % kCellSide < 4 ? 1.0f : 0.0f;
    const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations, -1e9f, &mask);
    const CellFit all = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations);
    EXPECT_TRUE(fit.converged);
    with_mask += DistancePx(fit.frame, cell.frame);
    without += all.converged ? DistancePx(all.frame, cell.frame) : photo.pitch_px;
    ++n;
  }
  EXPECT_LT(with_mask / n, 0.05 * photo.pitch_px);
  EXPECT_GT(without / n, 2 * with_mask / n);
}

TEST(CellFitter, CellsAtTheBorderAreFittedWithWhatIsInThePicture) {
  const Photograph photo{.width_px = 120, .height_px = 110, .pitch_px = 7, .bend_cells = 0.1, .noise = 1};
  const Fitting fitting(photo, TestBoard());
  int cut = 0;
  for (const PlacedCell& cell : fitting.Cells(1, 0.3)) {
    const bool inside = std::min({cell.frame.x, cell.frame.y, 119 - cell.frame.x, 109 - cell.frame.y}) > 12;
    if (inside) continue;
    const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations);
    ASSERT_TRUE(fit.converged);
    EXPECT_LT(DistancePx(fit.frame, cell.frame), 0.08 * photo.pitch_px);
    ++cut;
  }
  EXPECT_GT(cut, 30);
  CellFrame outside = fitting.Cells(1)[0].frame;
  outside.x = -40;
  EXPECT_FALSE(fitting.fitter().Fit(20, 20, outside, kAll, kIterations).converged);
}

TEST(CellFitter, MasksHoldAtTheBorderOfThePicture) {
  const Photograph photo{
      .width_px = 117, .height_px = 110, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0, .noise = 1};
  Frame frame = Render(photo, TestBoard());
  // Something bright in front of the lower half of the picture.
  auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
  std::fill(pixels->begin() + 3 * 117 * 55, pixels->end(), uint8_t{230});
  frame.pixels = pixels;
  const Fitting fitting(photo, TestBoard(), frame);
  int cut = 0;
  for (const PlacedCell& cell : fitting.Cells(1, 0.05)) {
    // Cells of the left and right border whose lower part is hidden.
    if (cell.frame.y < 46 || cell.frame.y > 54 || std::min(cell.frame.x, 116 - cell.frame.x) > 6.9f) continue;
    SampleMask mask;
    for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) {
      const float v = CellSample(k / kCellSide);
      mask.weights[k] = cell.frame.y + v * cell.frame.by < 53 ? 1.0f : 0.0f;
    }
    const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations, -1e9f, &mask);
    const CellFit all = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations);
    ASSERT_TRUE(fit.converged);
    EXPECT_LT(DistancePx(fit.frame, cell.frame), 0.1 * photo.pitch_px);
    EXPECT_LT(fit.noise, 0.5f * all.noise);
    ++cut;
  }
  EXPECT_GE(cut, 1);
}

TEST(CellFitter, OneStepGoesMostOfTheWay) {
  std::mt19937 random(9);
  const Photograph photo{.width_px = 110, .height_px = 100, .pitch_px = 7, .bend_cells = 0.1, .noise = 0.5};
  const Fitting fitting(photo, TestBoard());
  double before = 0, after = 0;
  for (const PlacedCell& cell : fitting.Cells(2)) {
    const CellFrame start = Disturbed(cell.frame, 0.06f, 0, random);
    const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, start, kAll, 1);
    before += std::pow(DistancePx(start, cell.frame), 2);
    after += std::pow(DistancePx(fit.frame, cell.frame), 2);
  }
  EXPECT_LT(std::sqrt(after / before), 0.1);
}

TEST(CellFitter, FlatClothIsNoPrint) {
  const Photograph photo{.width_px = 100, .height_px = 90};
  Photograph cloth = photo;
  cloth.rows = cloth.cols = 0;
  const Fitting fitting(photo, TestBoard(), Render(cloth, TestBoard()));
  for (const PlacedCell& cell : fitting.Cells(7)) {
    const CellFit fit = fitting.fitter().Fit(cell.row, cell.col, cell.frame, kAll, kIterations);
    EXPECT_TRUE(!fit.converged || fit.explained < 0.4) << fit.explained;
  }
}

}  // namespace
}  // namespace weft
