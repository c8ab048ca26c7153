#include "capture/image/picture_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

namespace weft {
namespace {

// A chequered scene through a lens: a Gaussian of this width, then exposure and a mosaic of two gains.
Frame Scene(double blur_px, double exposure) {
  Frame frame;
  frame.width_px = 320;
  frame.height_px = 240;
  frame.format = PixelFormat::kBayerRg8;
  std::vector<uint8_t> pixels;
  std::mt19937 random(7);
  const auto edge = [&](double t) { return 0.5 * (1 + std::erf(t / (std::sqrt(2.0) * blur_px))); };
  const auto wave = [&](int x) {  // stripes of 20 px
    const int stripe = x / 20;
    const double from_left = x % 20, value = stripe % 2;
    const double left = edge(from_left), right = edge(20 - from_left);
    return value * left * right + (1 - value) * (1 - left * right);
  };
  for (int y = 0; y < frame.height_px; ++y)
    for (int x = 0; x < frame.width_px; ++x) {
      const double gain = (x + y) % 2 == 0 ? 0.6 : 1.0;  // colours of the mosaic
      const double value =
          exposure * gain * (40 + 120 * wave(x) * wave(y)) + static_cast<double>(random() % 3);
      pixels.push_back(static_cast<uint8_t>(std::clamp(value, 0.0, 255.0)));
    }
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(pixels));
  return frame;
}

TEST(PictureQuality, FocusFallsWithBlurAndNotWithExposure) {
  const double sharp = MeasurePicture(Scene(0.7, 1)).focus;
  const double soft = MeasurePicture(Scene(2, 1)).focus;
  const double blurred = MeasurePicture(Scene(5, 1)).focus;
  EXPECT_GT(sharp, 1.3 * soft);
  EXPECT_GT(soft, 1.3 * blurred);
  EXPECT_NEAR(MeasurePicture(Scene(0.7, 0.5)).focus / sharp, 1, 0.05);
}

TEST(PictureQuality, CountsWhatIsLostInWhiteAndBlack) {
  Frame frame = Scene(1, 1);
  std::vector<uint8_t> pixels(frame.pixels->size(), 100);
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (i % 100 < 5) pixels[i] = 255;
    if (i % 100 >= 80) pixels[i] = 2;
  }
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(pixels);
  const PictureQuality quality = MeasurePicture(frame);
  EXPECT_NEAR(quality.clipped_share, 0.05, 0.01);
  EXPECT_NEAR(quality.dark_share, 0.2, 0.01);
  EXPECT_EQ(quality.low, 2);
  EXPECT_EQ(quality.middle, 100);
  EXPECT_EQ(quality.high, 255);
}

}  // namespace
}  // namespace weft
