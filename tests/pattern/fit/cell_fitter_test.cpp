#include "pattern/fit/cell_fitter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "tests/pattern/fit/true_cells.h"

namespace weft {
namespace {

constexpr NeighborWeights kAll = {1, 1, 1, 1, 1, 1, 1, 1, 1};
constexpr int kIterations = 6;

// A photograph with a fitter that knows its inks and blur.
class Fitting {
 public:
  Fitting(const Photograph& photo, const Board& board) : Fitting(photo, board, Render(photo, board)) {}
  Fitting(const Photograph& photo, const Board& board, const Frame& frame)
      : photo_(photo),
        board_(board),
        pyramid_(HalvingsOf(frame, 3)),
        profile_(board.square_fraction),
        appearance_(TrueAppearance(photo)),
        fitter_(pyramid_, board_, profile_, appearance_) {}

  const CellFitter& fitter() const { return fitter_; }
  std::vector<PlacedCell> Cells(int step, double margin_cells = 2) const {
    return TrueCells(photo_, board_, margin_cells, step);
  }

 private:
  const Photograph photo_;
  const Board& board_;
  const std::vector<ColorImage> pyramid_;
  const SampledProfile profile_;
  const Appearance appearance_;
  const CellFitter fitter_;
};

CellFit FitAt(const CellFitter& fitter, int row, int col, const CellPose& start,
              const NeighborWeights& weights, int iterations, float min_explained = -1e9f,
              const SampleMask* visible = nullptr) {
  return fitter.Fit({row, col, start, weights}, {.iterations = iterations, .min_explained = min_explained},
                    visible);
}

double DistancePx(const CellPose& f, const CellPose& g) { return std::hypot(f.x - g.x, f.y - g.y); }

// Moved by up to a share of a cell, and its edges changed by up to another.
CellPose Disturbed(const CellPose& f, float move, float shape, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const float u = move * uniform(random), v = move * uniform(random), stretch = 1 + shape * uniform(random),
              shear = shape * uniform(random);
  return {f.x + u * f.ax + v * f.bx, f.y + u * f.ay + v * f.by, stretch * f.ax, stretch * f.ay,
          f.bx + shear * f.ax,       f.by + shear * f.ay};
}

const Board& FittedBoard() {
  static const Board board = *GenerateBoard(60, 60, 3, 5);
  return board;
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
    const Fitting fitting(photo, FittedBoard());
    double squares = 0, edge_squares = 0, n = 0;
    for (const PlacedCell& cell : fitting.Cells(2)) {
      const CellPose start = Disturbed(cell.pose, 0.25f, 0.06f, random);
      const CellFit fit = FitAt(fitting.fitter(), cell.row, cell.col, start, kAll, kIterations);
      ASSERT_TRUE(fit.converged) << cell.row << " " << cell.col;
      EXPECT_LT(DistancePx(fit.pose, cell.pose), 0.05 * pitch_px) << cell.row << " " << cell.col;
      // A short last step is not evaluated again.
      EXPECT_GT(FitAt(fitting.fitter(), cell.row, cell.col, fit.pose, kAll, 1).explained, 0.93);
      EXPECT_GT(fit.gain, 0.6);
      EXPECT_LT(fit.gain, 1.5);
      squares += std::pow(DistancePx(fit.pose, cell.pose), 2);
      edge_squares += std::pow(fit.pose.ax - cell.pose.ax, 2) + std::pow(fit.pose.by - cell.pose.by, 2);
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
        const Fitting fitting(photo, FittedBoard());
        for (const PlacedCell& cell : fitting.Cells(2)) {
          const CellFit fit = FitAt(fitting.fitter(), cell.row, cell.col, cell.pose, kAll, kIterations);
          if (!fit.converged) continue;
          ratios += std::pow(DistancePx(fit.pose, cell.pose) / fit.sigma_px, 2) / 2;
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
  const Fitting fitting(photo, FittedBoard());
  std::mt19937 random(3);
  constexpr float kLeast = 0.5f;
  int wrong = 0, rejected = 0;
  for (const PlacedCell& cell : fitting.Cells(3)) {
    const CellPose start = Disturbed(cell.pose, 0.15f, 0.03f, random);
    const CellFit free = FitAt(fitting.fitter(), cell.row, cell.col, start, kAll, kIterations);
    const CellFit limited = FitAt(fitting.fitter(), cell.row, cell.col, start, kAll, kIterations, kLeast);
    EXPECT_TRUE(limited.converged);
    EXPECT_EQ(limited.pose.x, free.pose.x);
    EXPECT_EQ(limited.explained, free.explained);
    const int row = (cell.row + 23) % FittedBoard().rows, col = (cell.col + 31) % FittedBoard().cols;
    const CellFit other = FitAt(fitting.fitter(), row, col, start, kAll, kIterations, kLeast);
    const CellFit to_the_end = FitAt(fitting.fitter(), row, col, start, kAll, kIterations);
    ++wrong;
    rejected += !other.converged;
    // What is let go would not have come to the limit.
    if (!other.converged && to_the_end.converged) {
      EXPECT_LT(to_the_end.explained, kLeast);
    }
  }
  EXPECT_GE(rejected, 0.6 * wrong);
}

TEST(CellFitter, AStepExplainsWhatItPredicts) {
  const Photograph photo{
      .width_px = 160, .height_px = 140, .pitch_px = 8, .angle_deg = 25, .noise = 2, .seed = 4};
  const Fitting fitting(photo, FittedBoard());
  std::mt19937 random(5);
  double gained = 0, predicted = 0;
  for (const PlacedCell& truth : fitting.Cells(2)) {
    const CellPose start = Disturbed(truth.pose, 0.1f, 0.05f, random);
    const CellFit fit = FitAt(fitting.fitter(), truth.row, truth.col, start, kAll, 1);
    ASSERT_TRUE(fit.converged);
    EXPECT_NEAR(fit.explained, fit.predicted, 0.1);
    const float needed = fit.predicted + 0.5f;
    EXPECT_FALSE(FitAt(fitting.fitter(), truth.row, truth.col, start, kAll, 1, needed).converged);
    // By no step at all.
    const CellFit before = FitAt(fitting.fitter(), truth.row, truth.col, start, kAll, 2, 1e9f);
    gained += fit.explained - before.explained;
    predicted += fit.predicted - before.explained;
  }
  EXPECT_GT(gained, 0);
  EXPECT_NEAR(gained / predicted, 1, 0.1);
}

TEST(CellFitter, InksAreComparedOnTheCellItself) {
  const Photograph photo{.width_px = 120, .height_px = 110, .bend_cells = 0.2};
  const Frame frame = Render(photo, FittedBoard());
  const Fitting fitting(photo, FittedBoard(), frame);
  for (const PlacedCell& cell : fitting.Cells(5)) {
    const CellFit fit = FitAt(fitting.fitter(), cell.row, cell.col, cell.pose, kAll, kIterations);
    // The right ink fits as well as can be: any other changes what it changes.
    const float squared = fit.center_contrast * fit.center_contrast;
    EXPECT_GT(fit.ink_lead, 0.5f * squared);
    EXPECT_LT(fit.ink_lead, 1.6f * squared);
    // The same place, read with another ink in the middle.
    Board changed = FittedBoard();
    CellColor& ink = changed.cells[static_cast<size_t>(cell.row) * changed.cols + cell.col];
    ink = static_cast<CellColor>((static_cast<int>(ink) + 3) % kCellColors);
    const Fitting other(photo, changed, frame);
    EXPECT_LT(FitAt(other.fitter(), cell.row, cell.col, cell.pose, kAll, 1).ink_lead, 0);
  }
}

// Grey from 0.1 cells to the right of the cells' middles on, in every cell's own picture.
TEST(CellFitter, WhatIsMaskedDoesNotCount) {
  const Photograph photo{
      .width_px = 130, .height_px = 120, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0, .noise = 1};
  const Frame frame = Render(photo, FittedBoard());
  double with_mask = 0, without = 0, n = 0;
  for (const PlacedCell& cell : TrueCells(photo, FittedBoard(), 2, 9)) {
    Frame covered = frame;
    auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
    const int first = static_cast<int>(std::ceil(cell.pose.x + 0.1f * cell.pose.ax));
    for (int y = 0; y < frame.height_px; ++y)
      std::fill_n(&(*pixels)[3 * (static_cast<size_t>(y) * frame.width_px + first)],
                  3 * (frame.width_px - first), 160);
    covered.pixels = pixels;
    const Fitting fitting(photo, FittedBoard(), covered);
    SampleMask mask;
    for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) mask.weights[k] = k % kCellSide < 4 ? 1.0f : 0.0f;
    const CellFit fit =
        FitAt(fitting.fitter(), cell.row, cell.col, cell.pose, kAll, kIterations, -1e9f, &mask);
    const CellFit all = FitAt(fitting.fitter(), cell.row, cell.col, cell.pose, kAll, kIterations);
    EXPECT_TRUE(fit.converged);
    with_mask += DistancePx(fit.pose, cell.pose);
    without += all.converged ? DistancePx(all.pose, cell.pose) : photo.pitch_px;
    ++n;
  }
  EXPECT_LT(with_mask / n, 0.05 * photo.pitch_px);
  EXPECT_GT(without / n, 2 * with_mask / n);
}

TEST(CellFitter, CellsAtTheBorderAreFittedWithWhatIsInThePicture) {
  const Photograph photo{.width_px = 120, .height_px = 110, .pitch_px = 7, .bend_cells = 0.1, .noise = 1};
  const Fitting fitting(photo, FittedBoard());
  int cut = 0;
  for (const PlacedCell& cell : fitting.Cells(1, 0.3)) {
    const bool inside = std::min({cell.pose.x, cell.pose.y, 119 - cell.pose.x, 109 - cell.pose.y}) > 12;
    if (inside) continue;
    const CellFit fit = FitAt(fitting.fitter(), cell.row, cell.col, cell.pose, kAll, kIterations);
    ASSERT_TRUE(fit.converged);
    EXPECT_LT(DistancePx(fit.pose, cell.pose), 0.08 * photo.pitch_px);
    ++cut;
  }
  EXPECT_GT(cut, 30);
  CellPose outside = fitting.Cells(1)[0].pose;
  outside.x = -40;
  EXPECT_FALSE(FitAt(fitting.fitter(), 20, 20, outside, kAll, kIterations).converged);
}

TEST(CellFitter, FlatClothIsNoPrint) {
  const Photograph photo{.width_px = 100, .height_px = 90};
  Photograph cloth = photo;
  cloth.rows = cloth.cols = 0;
  const Fitting fitting(photo, FittedBoard(), Render(cloth, FittedBoard()));
  for (const PlacedCell& cell : fitting.Cells(7)) {
    const CellFit fit = FitAt(fitting.fitter(), cell.row, cell.col, cell.pose, kAll, kIterations);
    EXPECT_TRUE(!fit.converged || fit.explained < 0.4) << fit.explained;
  }
}

TEST(CellFitter, ACenterAloneIsPulledToWhereItIs) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> off(-0.1f, 0.1f);
  for (const double pitch_px : {5.0, 7.0, 12.0}) {
    const Photograph photo{.width_px = static_cast<int>(16 * pitch_px),
                           .height_px = static_cast<int>(15 * pitch_px),
                           .pitch_px = pitch_px,
                           .bend_cells = 0.1,
                           .noise = 0.5};
    const Fitting fitting(photo, FittedBoard());
    double squares = 0, n = 0;
    for (const PlacedCell& cell : fitting.Cells(2)) {
      NineCenters nodes = TrueNodes(photo, FittedBoard(), cell.row, cell.col);
      const float x = nodes.x[4], y = nodes.y[4];
      nodes.x[4] += off(random) * static_cast<float>(pitch_px);
      nodes.y[4] += off(random) * static_cast<float>(pitch_px);
      for (int step = 0; step < 3; ++step) {
        CenterNormal pull;
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

// Half the slope of the residuals' squares, by finite differences of what the fit says is left.
TEST(CellFitter, ThePullIsTheSlopeOfTheResiduals) {
  const Photograph photo{.width_px = 100, .height_px = 90, .pitch_px = 6.5, .bend_cells = 0.1, .noise = 0};
  const Fitting fitting(photo, FittedBoard());
  double weight = 0;
  for (int k = 0; k < kCellSide * kCellSide; ++k) {
    const double u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
    weight += (1 - u * u) * (1 - v * v);
  }
  double mixed = 0, numeric_squares = 0, pull_squares = 0;
  for (const PlacedCell& cell : fitting.Cells(3)) {
    NineCenters nodes = TrueNodes(photo, FittedBoard(), cell.row, cell.col);
    nodes.x[4] += 0.25f;
    nodes.y[4] -= 0.2f;
    CenterNormal pull;
    fitting.fitter().FitCenter(cell.row, cell.col, nodes, kAll, &pull);
    for (const bool along_x : {true, false}) {
      const auto sum_at = [&](float step) {
        NineCenters moved = nodes;
        (along_x ? moved.x : moved.y)[4] += step;
        CenterNormal unused;
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
TEST(CellFitter, WhereNeighborsAreUnknownThePrintIsTrusted) {
  const Photograph photo{
      .width_px = 120, .height_px = 110, .pitch_px = 8, .angle_deg = 0, .bend_cells = 0, .noise = 1};
  const Frame frame = Render(photo, FittedBoard());
  const NeighborWeights border = {1, 1, 0.4f, 1, 1, 0.4f, 1, 1, 0.4f};
  double trusting = 0, plain = 0;
  for (const PlacedCell& cell : TrueCells(photo, FittedBoard(), 2, 9)) {
    Frame covered = frame;
    auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
    const int first = static_cast<int>(std::ceil(cell.pose.x + 0.3f * cell.pose.ax));
    for (int y = 0; y < frame.height_px; ++y)
      std::fill_n(&(*pixels)[3 * (static_cast<size_t>(y) * frame.width_px + first)],
                  3 * (frame.width_px - first), 200);
    covered.pixels = pixels;
    const Fitting fitting(photo, FittedBoard(), covered);
    const NineCenters nodes = TrueNodes(photo, FittedBoard(), cell.row, cell.col);
    const auto moved_px = [&](const NeighborWeights& weights) {
      CenterNormal pull;
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

// What is wanted of a fit decides how much is computed, not what.
TEST(CellFitter, ExplainsAsMuchWhereNoPullIsAskedFor) {
  const Photograph photo{.width_px = 100, .height_px = 90, .pitch_px = 6.5, .bend_cells = 0.1};
  const Fitting fitting(photo, FittedBoard());
  const NeighborWeights border = {1, 1, 0.4f, 1, 1, 0.4f, 1, 1, 0.4f};
  for (const PlacedCell& cell : fitting.Cells(3)) {
    const NineCenters nodes = TrueNodes(photo, FittedBoard(), cell.row, cell.col);
    CenterNormal pull;
    const CellFit with = fitting.fitter().FitCenter(cell.row, cell.col, nodes, border, &pull);
    const CellFit without = fitting.fitter().FitCenter(cell.row, cell.col, nodes, border, nullptr);
    ASSERT_TRUE(with.converged && without.converged);
    EXPECT_EQ(with.explained, without.explained);
    EXPECT_EQ(with.gain, without.gain);
    EXPECT_EQ(with.noise, without.noise);
  }
}

}  // namespace
}  // namespace weft
