// Views of few grey levels: where centres are, and whether sigma_px says how sure that is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "base/median.h"
#include "pattern/decoder.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

const BoardIndex& DarkBoard() {
  static const Board board = *GenerateBoard(60, 60, 3, 5);
  static const BoardIndex index = *BoardIndex::Build(board);
  return index;
}

// With noise of 0.7 levels of its own. Of `lamp_rows` nothing is printed, but white.
Frame Darker(const Frame& frame, double times, int lamp_rows = 0) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.7);
  auto bytes = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
  for (size_t k = 0; k < bytes->size(); ++k) {
    const bool lamp = k < static_cast<size_t>(lamp_rows) * frame.width_px * 3;
    const double value = lamp ? 250 : (*bytes)[k] / times;
    (*bytes)[k] = static_cast<uint8_t>(std::clamp(std::lround(value + noise(random)), 0L, 255L));
  }
  Frame dark = frame;
  dark.pixels = std::move(bytes);
  return dark;
}

struct Seen {
  size_t cells = 0;
  double error_px = 0;  // median
  double beyond = 0;    // share of coordinates beyond three sigma
  double sigma_px = 0;  // median
  double grey_levels = 0;
};

Seen Look(const Photograph& photo, const Frame& frame) {
  const DecodeResult result = *DecodeView(frame, DarkBoard(), {.corners = false});
  std::vector<double> errors_px, sigmas_px;
  int beyond = 0;
  for (const Observation& o : result.observations) {
    const auto [x, y] = PixelFromBoard(photo, DarkBoard().board(), o.node.col + 0.5, o.node.row + 0.5);
    const double dx = std::abs(o.x_px - x), dy = std::abs(o.y_px - y);
    errors_px.push_back(std::hypot(dx, dy));
    sigmas_px.push_back(o.sigma_px);
    beyond += (dx > 3 * o.sigma_px) + (dy > 3 * o.sigma_px);
  }
  const double coordinates = 2 * static_cast<double>(std::max<size_t>(errors_px.size(), 1));
  return {errors_px.size(), Median(errors_px), beyond / coordinates, Median(sigmas_px), result.grey_levels};
}

class DarkViews : public testing::Test {
 protected:
  const Photograph photo_{.noise = 2};
  const Frame bright_ = Render(photo_, DarkBoard().board());
};

TEST_F(DarkViews, AreDecodedAsBrightOnesAre) {
  const Seen bright = Look(photo_, bright_);
  ASSERT_GT(bright.cells, 1000u);
  for (const double times : {3, 6, 12}) {
    const Seen dark = Look(photo_, Darker(bright_, times));
    EXPECT_GT(static_cast<double>(dark.cells), 0.97 * static_cast<double>(bright.cells)) << times;
    // Noise of 0.7 levels of 0 to 20 is much more than 2 of 0 to 240.
    EXPECT_LT(dark.error_px, times < 12 ? 1.5 * bright.error_px : 2.5 * bright.error_px) << times;
    EXPECT_NEAR(dark.grey_levels, bright.grey_levels / times, 0.15 * bright.grey_levels / times);
  }
}

// 0.3 % of a Gaussian are beyond three sigma.
TEST_F(DarkViews, KnowHowSureTheyAre) {
  for (const double times : {1, 3, 6, 12, 20}) {
    const Seen dark = Look(photo_, Darker(bright_, times));
    EXPECT_LT(dark.beyond, 0.01) << times;
    EXPECT_LT(dark.sigma_px, 3 * dark.error_px) << times;
  }
}

// The picture as a whole is not dark.
TEST_F(DarkViews, BesideALamp) {
  constexpr int kLampRows = 40;
  const Seen beside = Look(photo_, Darker(bright_, 8, kLampRows)), alone = Look(photo_, Darker(bright_, 8));
  EXPECT_GT(static_cast<double>(beside.cells), 0.8 * static_cast<double>(alone.cells));
  EXPECT_LT(beside.error_px, 1.3 * alone.error_px);
  EXPECT_LT(beside.beyond, 0.01);
}

}  // namespace
}  // namespace weft
