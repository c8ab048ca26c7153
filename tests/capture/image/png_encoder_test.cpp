#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "capture/image/image_decoders.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

// The same row of noise again and again.
std::vector<uint8_t> RepeatedRow(int width_px, int height_px) {
  std::vector<uint8_t> row(static_cast<size_t>(width_px)), bytes;
  uint64_t state = 1;
  for (uint8_t& value : row) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    value = static_cast<uint8_t>(state >> 56);
  }
  for (int y = 0; y < height_px; ++y) bytes.insert(bytes.end(), row.begin(), row.end());
  return bytes;
}

// Bytes 16 to 28 of the file are width, height, bits, colour type, compression, filter and interlace.
TEST(PngEncoder, HeadSaysSizeBitsAndKindOfColour) {
  const std::vector<uint8_t> bytes(48);
  const auto head_of = [](const ImagePixels& image) {
    const auto file = EncodePng(image);
    EXPECT_TRUE(file.ok()) << file.status();
    return std::string(file->begin() + 1, file->begin() + 4) +
           std::string(file->begin() + 16, file->begin() + 29);
  };
  EXPECT_EQ(head_of({4, 3, 1, 8, {bytes.data(), 12}}), std::string("PNG\0\0\0\4\0\0\0\3\x08\0\0\0\0", 16));
  EXPECT_EQ(head_of({4, 2, 3, 16, {bytes.data(), 48}}), std::string("PNG\0\0\0\4\0\0\0\2\x10\2\0\0\0", 16));
  EXPECT_EQ(head_of({3, 4, 4, 8, {bytes.data(), 48}}), std::string("PNG\0\0\0\3\0\0\0\4\x08\6\0\0\0", 16));
}

TEST(PngEncoder, EffortMakesFilesSmallAndChangesNoPixel) {
  const std::vector<uint8_t> bytes = RepeatedRow(256, 64);
  const auto fast = EncodePng({256, 64, 1, 8, bytes}, PngEffort::kFast);
  const auto small = EncodePng({256, 64, 1, 8, bytes}, PngEffort::kSmall);
  ASSERT_TRUE(fast.ok() && small.ok());
  EXPECT_LT(4 * small->size(), fast->size());
  EXPECT_EQ(DecodePng(*fast)->values, bytes);
  EXPECT_EQ(DecodePng(*small)->values, bytes);
}

TEST(PngEncoder, TheSamePixelsGiveTheSameBytes) {
  const std::vector<uint8_t> bytes = RepeatedRow(30, 10);
  EXPECT_EQ(*EncodePng({10, 10, 3, 8, bytes}), *EncodePng({10, 10, 3, 8, bytes}));
}

TEST(PngEncoder, OnePixelIsAPicture) {
  const uint8_t value = 77;
  const auto file = EncodePng({1, 1, 1, 8, {&value, 1}});
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(DecodePng(*file)->values, ::testing::ElementsAre(77));
}

}  // namespace
}  // namespace weft
