#include "capture/image/image_header.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Signature and IHDR of a PNG file, ISO/IEC 15948; checksums are not looked at for the header.
std::vector<uint8_t> PngStart(uint8_t width_px, uint8_t height_px) {
  return {0x89, 'P', 'N',      'G', '\r', '\n', 0x1a,      '\n', 0, 0, 0, 13, 'I', 'H', 'D', 'R', 0,
          0,    0,   width_px, 0,   0,    0,    height_px, 8,    2, 0, 0, 0,  0,   0,   0,   0};
}

TEST(ImageHeaders, TellTheSizeOfPngFiles) {
  const auto header = ReadImageHeader(PngStart(40, 24));
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_EQ(header->format, ImageFormat::kPng);
  EXPECT_EQ(header->width_px, 40);
  EXPECT_EQ(header->height_px, 24);
  EXPECT_EQ(header->orientation, 1);
}

TEST(ImageHeaders, TellTheOrientationThatAChunkHas) {
  std::vector<uint8_t> png = PngStart(40, 24);
  // EXIF with one entry: orientation 6.
  const std::vector<uint8_t> chunk = {0, 0, 0, 26, 'e', 'X',  'I', 'f', 'I', 'I', 42, 0, 8,
                                      0, 0, 0, 1,  0,   0x12, 1,   3,   0,   1,   0,  0, 0,
                                      6, 0, 0, 0,  0,   0,    0,   0,   0,   0,   0,  0};
  png.insert(png.end(), chunk.begin(), chunk.end());
  EXPECT_EQ(ReadImageHeader(png)->orientation, 6);
  EXPECT_EQ(OrientationText(6), "rotated by 90 degrees clockwise");
  EXPECT_EQ(OrientationText(1), "as it is stored");
}

TEST(ImageHeaders, RefuseWhatIsDamagedOrOfOtherKinds) {
  std::vector<uint8_t> cut = PngStart(40, 24);
  cut.resize(23);
  EXPECT_THAT(std::string(ReadImageHeader(cut).status().message()), HasSubstr("truncated"));
  EXPECT_THAT(std::string(ReadImageHeader(PngStart(0, 24)).status().message()), HasSubstr("0x24 pixels"));
  const std::vector<uint8_t> bitmap = {'B', 'M', 0, 0, 0, 0, 0, 0};
  EXPECT_THAT(std::string(ReadImageHeader(bitmap).status().message()), HasSubstr("not a PNG, JPEG or TIFF"));
  EXPECT_EQ(ReadImageHeader({}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ImageHeaders, OfFilesAreNamed) {
  const TempFolder folder;
  WriteBytes(folder / "a.png", "text");
  EXPECT_THAT(std::string(ReadImageFileHeader(folder / "a.png").status().message()),
              HasSubstr((folder / "a.png") + ": not a PNG"));
  const std::vector<uint8_t> png = PngStart(7, 9);
  WriteBytes(folder / "b.jpg", std::string(png.begin(), png.end()));
  EXPECT_EQ(ReadImageFileHeader(folder / "b.jpg")->height_px, 9);
}

}  // namespace
}  // namespace weft
