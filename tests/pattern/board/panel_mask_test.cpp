#include "pattern/board/panel_mask.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace weft {
namespace {

using ::testing::HasSubstr;

Frame Grey(int rows, int cols, const std::vector<uint8_t>& pixels) {
  return PanelsToMask(pixels, rows, cols);
}

TEST(PanelMask, OneColorMeansConnectedPieces) {
  // Two pieces of 3x3 and a stray pixel, which is no panel.
  std::vector<uint8_t> pixels(7 * 12, 0);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) pixels[12 * r + c] = 255, pixels[12 * (r + 3) + c + 6] = 255;
  pixels[12 * 6 + 1] = 255;
  const auto panels = PanelsFromMask(Grey(7, 12, pixels));
  ASSERT_TRUE(panels.ok()) << panels.status();
  EXPECT_EQ((*panels)[0], 1);
  EXPECT_EQ((*panels)[12 * 4 + 7], 2);
  EXPECT_EQ((*panels)[12 * 6 + 1], 0);
  EXPECT_EQ((*panels)[5], 0);
}

TEST(PanelMask, ColorsArePanelsEvenWhereTheyTouch) {
  Frame mask;
  mask.width_px = 6;
  mask.height_px = 4;
  mask.format = PixelFormat::kRgb8;
  auto pixels = std::make_shared<std::vector<uint8_t>>();
  for (int i = 0; i < 24; ++i) {
    const bool left = i % 6 < 3;
    pixels->insert(pixels->end(),
                   {static_cast<uint8_t>(left ? 200 : 0), 0, static_cast<uint8_t>(left ? 0 : 90)});
  }
  mask.pixels = pixels;
  const auto panels = PanelsFromMask(mask);
  ASSERT_TRUE(panels.ok()) << panels.status();
  EXPECT_EQ((*panels)[2], 1);
  EXPECT_EQ((*panels)[3], 2);
}

TEST(PanelMask, SurvivesItsImage) {
  std::vector<uint8_t> panels(60, 0);
  for (int i = 0; i < 20; ++i) panels[i] = 1, panels[40 + i] = 2;
  EXPECT_EQ(*PanelsFromMask(PanelsToMask(panels, 6, 10)), panels);
}

TEST(PanelMask, SaysWhatIsWrong) {
  EXPECT_THAT(PanelsFromMask(Grey(4, 4, std::vector<uint8_t>(16, 0))).status().message(),
              HasSubstr("no panel"));
  Frame colored;
  colored.width_px = colored.height_px = 64;
  colored.format = PixelFormat::kRgb8;
  auto pixels = std::make_shared<std::vector<uint8_t>>(3 * 64 * 64);
  // A colour for every ten pixels.
  for (size_t k = 0; k < 64 * 64; ++k)
    (*pixels)[3 * k] = 1, (*pixels)[3 * k + 1] = static_cast<uint8_t>(k / 10),
                  (*pixels)[3 * k + 2] = k / 2560;
  colored.pixels = pixels;
  EXPECT_THAT(PanelsFromMask(colored).status().message(), HasSubstr("at most 255"));
}

}  // namespace
}  // namespace weft
