#include "tests/benchmark/center_bound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pattern/fit/cell_fitter.h"
#include "tests/pattern/fit/true_cells.h"

namespace weft::testing {
namespace {

// A photograph of a board with all its centres as truth.
TrueView ViewOf(const Photograph& photo, const Board& board) {
  TrueView view{"0000", Render(photo, board), {}};
  for (const PlacedCell& cell : TrueCells(photo, board, 0)) {
    NodeTruth node;
    node.node = {cell.row, cell.col, NodeKind::kCenter};
    node.pixel_px = {cell.pose.x, cell.pose.y};
    node.pitch_px = photo.pitch_px;
    node.visible = node.scoreable = true;
    view.truth.nodes.push_back(node);
  }
  return view;
}

// The centre to which a fit of it alone, from the truth, is pulled.
std::pair<double, double> FittedOff(const CellFitter& fitter, NineCenters nodes, const BoardNode& node) {
  constexpr NeighborWeights kAll = {1, 1, 1, 1, 1, 1, 1, 1, 1};
  const float x = nodes.x[4], y = nodes.y[4];
  for (int step = 0; step < 3; ++step) {
    CenterNormal pull;
    EXPECT_TRUE(fitter.FitCenter(node.row, node.col, nodes, kAll, &pull).converged);
    const float determinant = pull.xx * pull.yy - pull.xy * pull.xy;
    nodes.x[4] -= (pull.yy * pull.x - pull.xy * pull.y) / determinant;
    nodes.y[4] -= (pull.xx * pull.y - pull.xy * pull.x) / determinant;
  }
  return {nodes.x[4] - x, nodes.y[4] - y};
}

TEST(CenterBound, LeastSquaresComeCloseToItAndNotBelow) {
  const Board board = *GenerateBoard(60, 60, 3, 5);
  const SampledProfile profile(board.square_fraction);
  for (const double pitch_px : {5.0, 7.0}) {
    for (const double noise : {5.0, 10.0}) {
      double squares = 0, n = 0;
      for (uint32_t seed = 1; seed <= 2; ++seed) {
        const Photograph photo{.width_px = static_cast<int>(16 * pitch_px),
                               .height_px = static_cast<int>(16 * pitch_px),
                               .pitch_px = pitch_px,
                               .bend_cells = 0.03,
                               .noise = noise,
                               .seed = seed};
        const TrueView view = ViewOf(photo, board);
        const Appearance appearance = TrueAppearance(photo);
        const auto bounds = CenterBounds(view, board, {appearance, noise});
        const std::vector<ColorImage> pyramid = HalvingsOf(view.image, 1);
        const CellFitter fitter(pyramid, board, profile, appearance);
        for (const PlacedCell& cell : TrueCells(photo, board, 2)) {
          const BoardNode node{cell.row, cell.col, NodeKind::kCenter};
          ASSERT_TRUE(bounds.contains(node));
          const auto [x, y] = FittedOff(fitter, TrueNodes(photo, board, cell.row, cell.col), node);
          squares += (x * x + y * y) / (2 * std::pow(bounds.at(node).noise_px, 2));
          ++n;
        }
      }
      ASSERT_GT(n, 200);
      const double ratio = std::sqrt(squares / n);
      EXPECT_GT(ratio, 0.93) << "pitch " << pitch_px << " noise " << noise;
      EXPECT_LT(ratio, 1.5) << "pitch " << pitch_px << " noise " << noise;
    }
  }
}

TEST(CenterBound, GrowsWithTheNoiseAndSeesTheResidual) {
  const Board board = *GenerateBoard(60, 60, 3, 5);
  const Photograph photo{.width_px = 110, .height_px = 100, .pitch_px = 7, .noise = 8};
  const TrueView view = ViewOf(photo, board);
  const auto of = [&](double noise) { return CenterBounds(view, board, {TrueAppearance(photo), noise}); };
  const auto bounds = of(8), half = of(4);
  double ratio = 0;
  for (const auto& [node, bound] : bounds) {
    EXPECT_NEAR(half.at(node).noise_px, 0.5 * bound.noise_px, 1e-9);
    ratio += half.at(node).residual_px / half.at(node).noise_px / static_cast<double>(bounds.size());
  }
  // Interpolation between pixels leaves two thirds of the noise in the residuals.
  EXPECT_GT(ratio, 1.15);
  EXPECT_LT(ratio, 2.2);
}

TEST(MeasureLook, FindsBlurAndNoise) {
  const Board board = *GenerateBoard(60, 60, 3, 5);
  for (const double noise : {2.0, 5.0}) {
    // The print takes the middle, plain cloth the rest.
    const Photograph photo{.width_px = 240,
                           .height_px = 200,
                           .pitch_px = 6,
                           .bend_cells = 0.1,
                           .noise = noise,
                           .row = 20,
                           .col = 20,
                           .rows = 20,
                           .cols = 20};
    TrueView view = ViewOf(photo, board);
    std::erase_if(view.truth.nodes, [](const NodeTruth& node) {
      const auto out = [](int at) { return at < 20 || at >= 40; };
      return out(node.node.row) || out(node.node.col);
    });
    const PictureLook look = MeasureLook(view, board);
    EXPECT_NEAR(look.noise, noise, 0.15 * noise);
    EXPECT_NEAR(look.appearance.sigma_px, TrueAppearance(photo).sigma_px, 0.12);
  }
}

}  // namespace
}  // namespace weft::testing
