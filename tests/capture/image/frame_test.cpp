#include "capture/image/frame.h"

#include <gtest/gtest.h>

#include <array>

namespace weft {
namespace {

Frame MakeFrame(int width, int height, PixelFormat format) {
  Frame frame;
  frame.width_px = width;
  frame.height_px = height;
  frame.format = format;
  frame.pixels =
      std::make_shared<const std::vector<uint8_t>>(width * height * BytesPerPixel(format), uint8_t{100});
  return frame;
}

TEST(Frame, RejectsPixelsThatDoNotFillTheSize) {
  Frame frame = MakeFrame(4, 3, PixelFormat::kRgb8);
  EXPECT_TRUE(frame.Validate().ok());
  frame.height_px = 4;
  EXPECT_FALSE(frame.Validate().ok());
  EXPECT_FALSE(Frame{}.Validate().ok());
}

TEST(Frame, FormatNamesRoundTrip) {
  for (const PixelFormat format : {PixelFormat::kGrey8, PixelFormat::kRgb8, PixelFormat::kBayerRg8,
                                   PixelFormat::kBayerGr8, PixelFormat::kBayerGb8, PixelFormat::kBayerBg8}) {
    EXPECT_EQ(*PixelFormatFromName(PixelFormatName(format)), format);
  }
  EXPECT_FALSE(PixelFormatFromName("rgb7").ok());
}

// A uniformly coloured scene behind each mosaic comes back in its colour.
TEST(ToRgb, DemosaicsEachBayerOrder) {
  const std::array<uint8_t, 3> scene = {200, 120, 40};
  const struct {
    PixelFormat format;
    std::array<int, 4> channel;  // of pixels (0,0) (1,0) (0,1) (1,1)
  } orders[] = {{PixelFormat::kBayerRg8, {0, 1, 1, 2}},
                {PixelFormat::kBayerGr8, {1, 0, 2, 1}},
                {PixelFormat::kBayerGb8, {1, 2, 0, 1}},
                {PixelFormat::kBayerBg8, {2, 1, 1, 0}}};
  for (const auto& order : orders) {
    std::vector<uint8_t> pixels;
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 10; ++x) pixels.push_back(scene[order.channel[(y % 2) * 2 + x % 2]]);
    }
    Frame frame = MakeFrame(10, 8, order.format);
    frame.pixels = std::make_shared<const std::vector<uint8_t>>(pixels);
    const auto rgb = ToRgb(frame);
    ASSERT_TRUE(rgb.ok());
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 10; ++x) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(rgb->row(y)[3 * x + c], scene[c])
              << PixelFormatName(order.format) << " " << x << "," << y;
        }
      }
    }
  }
}

TEST(ToRgb, RepeatsGreyAndSharesColour) {
  const auto grey = ToRgb(MakeFrame(2, 2, PixelFormat::kGrey8));
  ASSERT_TRUE(grey.ok());
  EXPECT_EQ(grey->pixels->size(), 12u);
  const Frame colour = MakeFrame(2, 2, PixelFormat::kRgb8);
  EXPECT_EQ(ToRgb(colour)->pixels, colour.pixels);
  EXPECT_FALSE(ToRgb(MakeFrame(2, 2, PixelFormat::kBayerRg8)).ok());
}

}  // namespace
}  // namespace weft
