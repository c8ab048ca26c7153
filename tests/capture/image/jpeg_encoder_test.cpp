#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "capture/image/image_decoders.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

constexpr int kJpegSide_px = 64;

// A soft wave, [rows][cols] of grey.
std::vector<uint8_t> Wave() {
  std::vector<uint8_t> bytes;
  for (int y = 0; y < kJpegSide_px; ++y)
    for (int x = 0; x < kJpegSide_px; ++x)
      bytes.push_back(static_cast<uint8_t>(128 + 60 * std::sin(0.3 * x) * std::cos(0.2 * y)));
  return bytes;
}

// The largest difference of a pixel.
int ErrorAt(int quality, size_t* size) {
  const std::vector<uint8_t> bytes = Wave();
  const auto file = EncodeJpeg({kJpegSide_px, kJpegSide_px, 1, 8, bytes}, quality);
  EXPECT_TRUE(file.ok()) << file.status();
  *size = file->size();
  const auto read = DecodeJpeg(*file);
  EXPECT_TRUE(read.ok()) << read.status();
  int worst = 0;
  for (size_t i = 0; i < bytes.size(); ++i) worst = std::max(worst, std::abs(bytes[i] - read->values[i]));
  return worst;
}

TEST(JpegEncoder, QualityBuysExactnessWithBytes) {
  size_t low = 0, middle = 0, high = 0;
  const int low_error = ErrorAt(20, &low), middle_error = ErrorAt(75, &middle),
            high_error = ErrorAt(100, &high);
  EXPECT_LT(low, middle);
  EXPECT_LT(middle, high);
  EXPECT_GE(low_error, middle_error);
  EXPECT_GT(low_error, high_error);
  EXPECT_LE(high_error, 2);
}

// SOI begins the file and EOI ends it; SOF0 (ff c0) says at its eighth byte how many components there are.
TEST(JpegEncoder, GreyHasOneComponentAndColourThree) {
  const std::vector<uint8_t> bytes(3 * 16 * 16, uint8_t{90});
  for (const int channels : {1, 3}) {
    const auto file =
        EncodeJpeg({16, 16, channels, 8, {bytes.data(), static_cast<size_t>(channels) * 16 * 16}}, 90);
    ASSERT_TRUE(file.ok()) << file.status();
    const std::string text(file->begin(), file->end());
    EXPECT_EQ(text.substr(0, 2), "\xff\xd8");
    EXPECT_EQ(text.substr(text.size() - 2), "\xff\xd9");
    const size_t frame = text.find("\xff\xc0");
    ASSERT_NE(frame, std::string::npos);
    EXPECT_EQ(text.at(frame + 9), channels);
    const auto read = DecodeJpeg(*file);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->channels, channels);
    for (const uint8_t value : read->values) EXPECT_NEAR(value, 90, 1);
  }
}

TEST(JpegEncoder, APictureThatIsTooWideForTheFormatIsRefused) {
  const std::vector<uint8_t> bytes(70'000);
  const absl::Status status = EncodeJpeg({70'000, 1, 1, 8, bytes}, 90).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("cannot be encoded as JPEG"));
}

}  // namespace
}  // namespace weft
