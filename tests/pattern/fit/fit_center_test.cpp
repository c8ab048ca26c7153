#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "pattern/fit/cell_fitter.h"
#include "tests/pattern/fit/fitting.h"

namespace weft {
namespace {

TEST(FitCenter, ACenterAloneIsPulledToWhereItIs) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> off(-0.1f, 0.1f);
  for (const double pitch_px : {5.0, 7.0, 12.0}) {
    const Photograph photo{.width_px = static_cast<int>(16 * pitch_px),
                           .height_px = static_cast<int>(15 * pitch_px),
                           .pitch_px = pitch_px,
                           .bend_cells = 0.1,
                           .noise = 0.5};
    const Fitting fitting(photo, TestBoard());
    double squares = 0, n = 0;
    for (const PlacedCell& cell : fitting.Cells(2)) {
      CellNodes nodes = TrueNodes(photo, TestBoard(), cell.row, cell.col);
      const float x = nodes.x[4], y = nodes.y[4];
      nodes.x[4] += off(random) * static_cast<float>(pitch_px);
      nodes.y[4] += off(random) * static_cast<float>(pitch_px);
      for (int step = 0; step < 3; ++step) {
        CenterPull pull;
        ASSERT_TRUE(fitting.fitter().FitCenter(cell.row, cell.col, nodes, kAll, &pull).converged);
        const float determinant = pull.xx * pull.yy - pull.xy * pull.xy;
        ASSERT_GT(determinant, 0);
        nodes.x[4] -= (pull.yy * pull.x - pull.xy * pull.y) / determinant;
        nodes.y[4] -= (pull.xx * pull.y - pull.xy * pull.x) / determinant;
      }
      squares += std::pow(nodes.x[4] - x, 2) + std::pow(nodes.y[4] - y, 2);
      ++n;
    }
    ASSERT_GT(n, 40);
    EXPECT_LT(std::sqrt(squares / (2 * n)), 0.012 * pitch_px) << "pitch " << pitch_px;
  }
}

// The second derivative by finite differences of the first, for cells that are slanted in the image, so that
// neither axis goes without the other.
TEST(FitCenter, ThePullChangesAsItsSecondDerivativeSays) {
  const Photograph photo{.width_px = 110,
                         .height_px = 110,
                         .pitch_px = 10,
                         .angle_deg = 45,
                         .bend_cells = 0.1,
                         .squeeze = 0.4,
                         .noise = 0};
  const Fitting fitting(photo, TestBoard());
  double mixed[3] = {}, numeric_squares[3] = {}, said_squares[3] = {};
  for (const PlacedCell& cell : fitting.Cells(2)) {
    const CellNodes nodes = TrueNodes(photo, TestBoard(), cell.row, cell.col);
    const auto pull_at = [&](float dx, float dy) {
      CellNodes moved = nodes;
      moved.x[4] += dx;
      moved.y[4] += dy;
      CenterPull pull;
      EXPECT_TRUE(fitting.fitter().FitCenter(cell.row, cell.col, moved, kAll, &pull).converged);
      return pull;
    };
    constexpr float kStepPx = 0.15f;
    const CenterPull right = pull_at(kStepPx, 0), left = pull_at(-kStepPx, 0), down = pull_at(0, kStepPx),
                     up = pull_at(0, -kStepPx), here = pull_at(0, 0);
    const double numeric[] = {(right.x - left.x) / (2 * kStepPx),
                              (right.y - left.y + down.x - up.x) / (4 * kStepPx),
                              (down.y - up.y) / (2 * kStepPx)};
    const double said[] = {here.xx, here.xy, here.yy};
    for (int k = 0; k < 3; ++k) {
      mixed[k] += numeric[k] * said[k];
      numeric_squares[k] += numeric[k] * numeric[k];
      said_squares[k] += said[k] * said[k];
    }
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(mixed[k] / std::sqrt(numeric_squares[k] * said_squares[k]), 0.9) << "xx, xy, yy: " << k;
    EXPECT_NEAR(std::sqrt(said_squares[k] / numeric_squares[k]), 1, 0.2) << "xx, xy, yy: " << k;
  }
}

// Half the slope of the residuals' squares, by finite differences of what the fit says is left.
TEST(FitCenter, ThePullIsTheSlopeOfTheResiduals) {
  const Photograph photo{.width_px = 100, .height_px = 90, .pitch_px = 6.5, .bend_cells = 0.1, .noise = 0};
  const Fitting fitting(photo, TestBoard());
  double weight = 0;
  for (int k = 0; k < kCellSide * kCellSide; ++k) {
    const double u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
    weight += (1 - u * u) * (1 - v * v);
  }
  double mixed = 0, numeric_squares = 0, pull_squares = 0;
  for (const PlacedCell& cell : fitting.Cells(3)) {
    CellNodes nodes = TrueNodes(photo, TestBoard(), cell.row, cell.col);
    nodes.x[4] += 0.25f;
    nodes.y[4] -= 0.2f;
    CenterPull pull;
    fitting.fitter().FitCenter(cell.row, cell.col, nodes, kAll, &pull);
    for (const bool along_x : {true, false}) {
      const auto sum_at = [&](float step) {
        CellNodes moved = nodes;
        (along_x ? moved.x : moved.y)[4] += step;
        CenterPull unused;
        const CellFit fit = fitting.fitter().FitCenter(cell.row, cell.col, moved, kAll, &unused);
        return 3 * weight * fit.noise * fit.noise / (kModelNoise * kModelNoise);
      };
      constexpr float kStepPx = 0.05f;
      const double numeric = (sum_at(kStepPx) - sum_at(-kStepPx)) / (4 * kStepPx);
      const double slope = along_x ? pull.x : pull.y;
      mixed += numeric * slope;
      numeric_squares += numeric * numeric;
      pull_squares += slope * slope;
    }
  }
  // Gauss-Newton takes the slopes of the print for those of the image.
  EXPECT_GT(mixed / std::sqrt(numeric_squares * pull_squares), 0.98);
  EXPECT_NEAR(std::sqrt(pull_squares / numeric_squares), 1, 0.15);
}

// Something in front of a border cell, whose neighbours there are unknown, counts less than the print.
TEST(FitCenter, WhereNeighborsAreUnknownThePrintIsTrusted) {
  const Photograph photo{
      .width_px = 120, .height_px = 110, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0, .noise = 1};
  const Frame frame = Render(photo, TestBoard());
  const NeighborWeights border = {1, 1, 0.4f, 1, 1, 0.4f, 1, 1, 0.4f};
  double trusting = 0, plain = 0;
  for (const PlacedCell& cell : TrueCells(photo, TestBoard(), 2, 9)) {
    Frame covered = frame;
    auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
    const int first = static_cast<int>(std::ceil(cell.frame.x + 0.3f * cell.frame.ax));
    for (int y = 0; y < frame.height_px; ++y)
      std::fill_n(&(*pixels)[3 * (static_cast<size_t>(y) * frame.width_px + first)],
                  3 * (frame.width_px - first), 200);
    covered.pixels = pixels;
    const Fitting fitting(photo, TestBoard(), covered);
    const CellNodes nodes = TrueNodes(photo, TestBoard(), cell.row, cell.col);
    const auto moved_px = [&](const NeighborWeights& weights) {
      CenterPull pull;
      if (!fitting.fitter().FitCenter(cell.row, cell.col, nodes, weights, &pull).converged) return 8.0;
      const double determinant = pull.xx * pull.yy - pull.xy * pull.xy;
      return std::hypot(pull.yy * pull.x - pull.xy * pull.y, pull.xx * pull.y - pull.xy * pull.x) /
             determinant;
    };
    trusting += moved_px(border);
    plain += moved_px(kAll);
  }
  EXPECT_LT(trusting, 0.85 * plain);
}

TEST(FitCenter, WithoutOccluderUnknownNeighborsLeaveThePullAsItIs) {
  const Photograph photo{.width_px = 120, .height_px = 110, .pitch_px = 7, .bend_cells = 0.1, .noise = 1};
  const Fitting fitting(photo, TestBoard());
  const NeighborWeights border = {1, 1, 0.4f, 1, 1, 0.4f, 1, 1, 0.4f};
  double before = 0, after = 0;
  for (const PlacedCell& cell : fitting.Cells(3)) {
    CellNodes nodes = TrueNodes(photo, TestBoard(), cell.row, cell.col);
    nodes.x[4] += 0.3f;
    nodes.y[4] -= 0.2f;
    CenterPull pull;
    ASSERT_TRUE(fitting.fitter().FitCenter(cell.row, cell.col, nodes, border, &pull).converged);
    const double determinant = pull.xx * pull.yy - pull.xy * pull.xy;
    before += 0.3 * 0.3 + 0.2 * 0.2;
    after += std::pow(0.3 - (pull.yy * pull.x - pull.xy * pull.y) / determinant, 2) +
             std::pow(-0.2 - (pull.xx * pull.y - pull.xy * pull.x) / determinant, 2);
  }
  EXPECT_LT(std::sqrt(after / before), 0.35);
}

}  // namespace
}  // namespace weft
