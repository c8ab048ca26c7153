#include "pattern/image/exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace weft {
namespace {

constexpr int kWidth = 301, kHeight = 203;

// Values by row, column and channel.
Frame FrameWith(PixelFormat format, const std::function<double(int, int, int)>& value) {
  Frame frame;
  frame.width_px = kWidth;
  frame.height_px = kHeight;
  frame.format = format;
  const int channels = BytesPerPixel(format);
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < channels; ++c)
        pixels->push_back(static_cast<uint8_t>(std::clamp(std::lround(value(y, x, c)), 0L, 255L)));
  frame.pixels = std::move(pixels);
  return frame;
}

// A number for a place, as if drawn.
int Stripes(int y, int x, int c, int below) {
  uint32_t hash = static_cast<uint32_t>(y) * 73856093u ^ static_cast<uint32_t>(x) * 19349663u ^
                  static_cast<uint32_t>(c) * 83492791u;
  hash = (hash ^ hash >> 13) * 0x5bd1e995u;
  return static_cast<int>((hash ^ hash >> 15) % static_cast<uint32_t>(below));
}

// Every level up to `white`, all over the picture.
Frame Spread(PixelFormat format, int white) {
  return FrameWith(format, [=](int y, int x, int c) { return Stripes(y, x, c, white + 1); });
}

constexpr PixelFormat kFormats[] = {PixelFormat::kRgb8, PixelFormat::kBayerRg8, PixelFormat::kGrey8};

TEST(Exposure, LeavesPicturesAloneThatReachHalfOfWhite) {
  for (const PixelFormat format : kFormats) {
    for (const int white : {255, 200, 125}) {
      const Exposure exposure = MeasureExposure(Spread(format, white));
      EXPECT_EQ(exposure.gain, 1) << white;
      EXPECT_EQ(exposure.step, 1) << white;
    }
  }
}

TEST(Exposure, BrightensDarkPicturesWithoutCuttingThem) {
  for (const PixelFormat format : kFormats) {
    for (const int white : {5, 20, 63, 110}) {
      const Frame frame = Spread(format, white);
      const Exposure exposure = MeasureExposure(frame);
      EXPECT_EQ(exposure.step, static_cast<float>(exposure.gain));
      EXPECT_GT(exposure.gain * white, 160);
      EXPECT_LE(exposure.gain * white, 255);
      const Frame bright = Brightened(frame, exposure.gain);
      for (size_t k = 0; k < frame.pixels->size(); ++k)
        ASSERT_EQ((*bright.pixels)[k], exposure.gain * (*frame.pixels)[k]);
    }
  }
}

TEST(Exposure, LampsAndHotPixelsDoNotHideThatAPictureIsDark) {
  const Frame frame = FrameWith(PixelFormat::kRgb8, [](int y, int x, int c) {
    return y % 50 == 3 && x == 20 ? 255 : Stripes(y, x, c, 21);
  });
  EXPECT_EQ(MeasureExposure(frame).gain, 12);
  const Frame bright = Brightened(frame, 12);
  EXPECT_EQ(*std::max_element(bright.pixels->begin(), bright.pixels->end()), 255);
}

// Sixteen levels that a program stretched to the whole range, as after a conversion of 12 bits in 16 to 8.
TEST(Exposure, SeesLevelsThatWereStretched) {
  for (const PixelFormat format : kFormats) {
    for (const int levels : {8, 16, 32, 64}) {
      const Frame frame = FrameWith(
          format, [=](int y, int x, int c) { return Stripes(y, x, c, levels) * 255.0 / (levels - 1); });
      const Exposure exposure = MeasureExposure(frame);
      EXPECT_EQ(exposure.gain, 1);
      EXPECT_NEAR(exposure.step, 255.0 / (levels - 1), 1) << levels;
    }
  }
}

// A drawing of few colours is exact: nothing in it was rounded.
TEST(Exposure, DrawingsAreNotStretched) {
  const Frame frame = FrameWith(PixelFormat::kRgb8, [](int y, int x, int c) {
    constexpr int kLevels[] = {0, 3, 40, 90, 180, 255};
    return kLevels[(y / 9 + x / 7 + c) % 6];
  });
  EXPECT_EQ(MeasureExposure(frame).step, 1);
}

}  // namespace
}  // namespace weft
