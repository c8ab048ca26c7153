#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "capture/image/image_decoders.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

std::string JpegFile() {
  std::vector<uint8_t> bytes;
  for (int i = 0; i < 40 * 24; ++i) bytes.push_back(static_cast<uint8_t>(i * 5));
  const auto file = EncodeJpeg({40, 24, 1, 8, bytes}, 90);
  EXPECT_TRUE(file.ok()) << file.status();
  return {file->begin(), file->end()};
}

absl::StatusOr<DecodedImage> DecodedJpeg(const std::string& file, JpegOrigin origin = JpegOrigin::kFile) {
  return DecodeJpeg({reinterpret_cast<const uint8_t*>(file.data()), file.size()}, origin);
}

absl::StatusOr<ImageHeader> HeaderOf(const std::string& file) {
  return ReadJpegHeader({reinterpret_cast<const uint8_t*>(file.data()), file.size()});
}

// Behind SOI: a segment APP1 with an Exif directory of one entry, the orientation.
std::string WithOrientation(const std::string& file, char orientation) {
  const std::string exif = std::string("Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", 24) +
                           orientation + std::string("\0\0\0\0\0\0\0", 7);
  const std::string segment = std::string("\xff\xe1\0", 3) + static_cast<char>(exif.size() + 2) + exif;
  return file.substr(0, 2) + segment + file.substr(2);
}

TEST(JpegDecoder, TheHeadTellsSizeAndOrientationWithoutPixels) {
  const auto plain = HeaderOf(JpegFile());
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_EQ(plain->width_px, 40);
  EXPECT_EQ(plain->height_px, 24);
  EXPECT_EQ(plain->orientation, 1);
  EXPECT_EQ(HeaderOf(WithOrientation(JpegFile(), 6))->orientation, 6);
  // The last pixels are gone, and the head is whole.
  EXPECT_TRUE(HeaderOf(JpegFile().substr(0, JpegFile().size() - 20)).ok());
}

TEST(JpegDecoder, OrientationTurnsNoPixel) {
  EXPECT_EQ(DecodedJpeg(WithOrientation(JpegFile(), 6))->values, DecodedJpeg(JpegFile())->values);
}

// Cameras put bytes between the last pixel and the end marker. In a file they tell of damage.
TEST(JpegDecoder, StrayBytesBeforeTheEndAreForgivenToCamerasAlone) {
  const std::string file = JpegFile();
  const std::string stray =
      file.substr(0, file.size() - 2) + std::string(64, '\x11') + file.substr(file.size() - 2);
  const absl::Status refused = DecodedJpeg(stray).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("damaged or truncated"));
  const auto forgiven = DecodedJpeg(stray, JpegOrigin::kCamera);
  ASSERT_TRUE(forgiven.ok()) << forgiven.status();
  EXPECT_EQ(forgiven->values, DecodedJpeg(file)->values);
}

TEST(JpegDecoder, WhatFollowsTheEndDoesNotCount) {
  const auto read = DecodedJpeg(JpegFile() + "padding of a buffer");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->values, DecodedJpeg(JpegFile())->values);
}

TEST(JpegDecoder, APictureThatIsCutIsRefusedFromCamerasToo) {
  const std::string file = JpegFile();
  for (const JpegOrigin origin : {JpegOrigin::kFile, JpegOrigin::kCamera}) {
    for (const size_t size : {size_t{0}, size_t{2}, size_t{30}, file.size() / 2, file.size() - 2}) {
      EXPECT_EQ(DecodedJpeg(file.substr(0, size), origin).status().code(), absl::StatusCode::kInvalidArgument)
          << size;
    }
  }
}

TEST(JpegDecoder, AKindThatIsNotReadIsNamedAsOne) {
  std::string hierarchical = JpegFile();
  hierarchical[hierarchical.find("\xff\xc0") + 1] = '\xc5';
  const absl::Status status = DecodedJpeg(hierarchical).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("of a kind that is not read"));
}

}  // namespace
}  // namespace weft
