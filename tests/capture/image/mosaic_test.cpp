#include "capture/image/mosaic.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

// A smooth picture whose colours differ by `contrast`, through a mosaic, with noise of single pixels.
Frame Grey(int contrast, int noise) {
  Frame frame;
  frame.width_px = 60;
  frame.height_px = 40;
  std::vector<uint8_t> pixels;
  uint32_t random = 1;
  for (int y = 0; y < frame.height_px; ++y) {
    for (int x = 0; x < frame.width_px; ++x) {
      const bool green = (x + y) % 2 == 0;
      random = random * 1664525u + 1013904223u;
      const int jitter = noise > 0 ? static_cast<int>(random >> 24) % noise : 0;
      pixels.push_back(
          static_cast<uint8_t>(100 + 40 * std::sin(0.2 * x + 0.1 * y) + green * contrast + jitter));
    }
  }
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(pixels);
  return frame;
}

TEST(Mosaic, AlternatingPixelsTellIt) {
  EXPECT_TRUE(LooksLikeMosaic(Grey(60, 10)));
  EXPECT_FALSE(LooksLikeMosaic(Grey(0, 10)));
  EXPECT_FALSE(LooksLikeMosaic(Grey(0, 0)));
  EXPECT_FALSE(LooksLikeMosaic(Grey(0, 60)));  // noise alone
}

TEST(Mosaic, NamesOfOrders) {
  EXPECT_EQ(MosaicFromName("").value(), std::nullopt);
  EXPECT_EQ(MosaicFromName("bayer_gb8").value(), PixelFormat::kBayerGb8);
  for (const char* name : {"rgb8", "grey8", "bayer"})
    EXPECT_EQ(MosaicFromName(name).status().code(), absl::StatusCode::kInvalidArgument) << name;
}

}  // namespace
}  // namespace weft
