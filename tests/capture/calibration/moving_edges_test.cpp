#include "capture/calibration/moving_edges.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <memory>

namespace weft {
namespace {

using ::testing::HasSubstr;

Frame PictureOf(int width, int height, const std::function<double(int, int)>& light) {
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pixels->push_back(static_cast<uint8_t>(std::lround(light(x, y))));
  }
  Frame frame;
  frame.width_px = width;
  frame.height_px = height;
  frame.format = PixelFormat::kGrey8;
  frame.pixels = std::move(pixels);
  return frame;
}

// A bright band whose slanted borders are steps blurred by a normal distribution, before a still room of
// sharp stripes below it. `moves_px` from picture to picture.
std::vector<Frame> Band(double sigma_px, double moves_px, int pictures = 5) {
  std::vector<Frame> out;
  for (int i = 0; i < pictures; ++i) {
    out.push_back(PictureOf(240, 160, [&](int x, int y) {
      if (y >= 110) return x / 6 % 2 == 0 ? 30.0 : 220.0;
      const double across = 0.8 * (x - 40 - i * moves_px) + 0.6 * (y - 55);
      const auto step = [&](double at) {
        return 0.5 * (1 + std::erf((across - at) / sigma_px / std::sqrt(2)));
      };
      return 40 + 160 * (step(0) - step(24));
    }));
  }
  return out;
}

TEST(MovingEdges, TheBlurOfWhatMovesIsMeasured) {
  for (const double sigma_px : {0.8, 1.5, 3.0}) {
    const auto blur = MovingEdgeBlurPx(Band(sigma_px, 31));
    ASSERT_TRUE(blur.ok() && blur->has_value()) << sigma_px;
    EXPECT_NEAR(**blur / sigma_px, 1, 0.15) << sigma_px;
  }
}

TEST(MovingEdges, NothingIsSaidOfAStillRoom) {
  const auto blur = MovingEdgeBlurPx(Band(1, 0));
  ASSERT_TRUE(blur.ok());
  EXPECT_FALSE(blur->has_value());
}

TEST(MovingEdges, PicturesThatCannotBeComparedAreRefused) {
  EXPECT_THAT(MovingEdgeBlurPx(Band(1, 31, 2)).status().message(), HasSubstr("at least 3"));
  std::vector<Frame> mixed = Band(1, 31);
  mixed.push_back(PictureOf(100, 90, [](int, int) { return 0.0; }));
  EXPECT_THAT(MovingEdgeBlurPx(mixed).status().message(), HasSubstr("different sizes"));
}

}  // namespace
}  // namespace weft
