#include "capture/image/thumbnail.h"

#include <gtest/gtest.h>

#include <random>

namespace weft {
namespace {

Frame RandomRgb(int width_px, int height_px, uint32_t seed) {
  std::mt19937 random(seed);
  auto pixels = std::make_shared<std::vector<uint8_t>>(3 * width_px * height_px);
  for (uint8_t& value : *pixels) value = static_cast<uint8_t>(random());
  return {"camera", width_px, height_px, PixelFormat::kRgb8, pixels, 0, "test"};
}

TEST(Thumbnail, EachPixelIsTheMeanOfThoseThatFallOnIt) {
  const int factor = 5, width_px = 8, height_px = 6;
  const Frame frame = RandomRgb(factor * width_px, factor * height_px, 1);
  const absl::StatusOr<Frame> small = Thumbnail(frame, width_px);
  ASSERT_TRUE(small.ok()) << small.status();
  ASSERT_EQ(small->width_px, width_px);
  ASSERT_EQ(small->height_px, height_px);
  EXPECT_EQ(small->camera_id, frame.camera_id);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        double sum = 0;
        for (int i = 0; i < factor * factor; ++i) {
          const int row = factor * y + i / factor, col = factor * x + i % factor;
          sum += (*frame.pixels)[3 * (row * frame.width_px + col) + channel];
        }
        EXPECT_NEAR((*small->pixels)[3 * (y * width_px + x) + channel], sum / (factor * factor), 0.51);
      }
    }
  }
}

TEST(Thumbnail, KeepsTheShape) {
  const absl::StatusOr<Frame> upright = Thumbnail(RandomRgb(200, 300, 2), 50);
  ASSERT_TRUE(upright.ok());
  EXPECT_EQ(upright->width_px, 50);
  EXPECT_EQ(upright->height_px, 75);
  const absl::StatusOr<Frame> line = Thumbnail(RandomRgb(400, 2, 3), 20);
  ASSERT_TRUE(line.ok());
  EXPECT_EQ(line->height_px, 1);
}

TEST(Thumbnail, LeavesNarrowFramesAsTheyAre) {
  const Frame frame = RandomRgb(20, 10, 4);
  const absl::StatusOr<Frame> same = Thumbnail(frame, 20);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->width_px, 20);
  EXPECT_EQ(*same->pixels, *frame.pixels);
}

TEST(Thumbnail, DevelopsMosaics) {
  auto pixels = std::make_shared<std::vector<uint8_t>>(64 * 64, 90);
  const absl::StatusOr<Frame> small =
      Thumbnail({"camera", 64, 64, PixelFormat::kBayerRg8, pixels, 0, "test"}, 16);
  ASSERT_TRUE(small.ok()) << small.status();
  EXPECT_EQ(small->format, PixelFormat::kRgb8);
  EXPECT_EQ(small->pixels->size(), 3u * 16 * 16);
  for (const uint8_t value : *small->pixels) EXPECT_EQ(value, 90);
}

TEST(Resized, RefusesSizesAndFramesThatCannotBe) {
  EXPECT_EQ(Resized(RandomRgb(8, 8, 5), 0, 4).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Resized(RandomRgb(8, 8, 5), 4, -1).status().code(), absl::StatusCode::kInvalidArgument);
  Frame torn = RandomRgb(8, 8, 6);
  torn.height_px = 9;
  EXPECT_EQ(Resized(torn, 4, 4).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
