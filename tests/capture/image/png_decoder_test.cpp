// PNG files put together chunk by chunk, as the specification lays them out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <vector>

#include "capture/image/image_decoders.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string BigEndian32(uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

std::string PngChunk(const std::string& kind, const std::string& data) {
  const std::string body = kind + data;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return BigEndian32(static_cast<uint32_t>(data.size())) + body + BigEndian32(static_cast<uint32_t>(crc));
}

// One row: filter 0, then `row`. `between`: chunks in front of the pixels.
std::string PngOfRow(int width_px, int bits, int color, const std::string& row,
                     const std::string& between = "") {
  const std::string filtered = std::string(1, '\0') + row;
  std::vector<Bytef> packed(compressBound(filtered.size()));
  uLongf size = packed.size();
  EXPECT_EQ(compress(packed.data(), &size, reinterpret_cast<const Bytef*>(filtered.data()), filtered.size()),
            Z_OK);
  const std::string head = BigEndian32(static_cast<uint32_t>(width_px)) + BigEndian32(1) +
                           std::string{static_cast<char>(bits), static_cast<char>(color), 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" + PngChunk("IHDR", head) + between +
         PngChunk("IDAT", {packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size)}) +
         PngChunk("IEND", "");
}

absl::StatusOr<DecodedImage> DecodedPng(const std::string& file) {
  return DecodePng({reinterpret_cast<const uint8_t*>(file.data()), file.size()});
}

TEST(PngDecoder, PalettesBecomeColours) {
  const std::string palette = PngChunk("PLTE", std::string("\xff\x00\x00\x00\x00\xff", 6));
  const auto image = DecodedPng(PngOfRow(3, 8, 3, std::string("\x01\x00\x01", 3), palette));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->width_px, 3);
  EXPECT_EQ(image->height_px, 1);
  EXPECT_EQ(image->channels, 3);
  EXPECT_THAT(image->values, ElementsAre(0, 0, 255, 255, 0, 0, 0, 0, 255));
}

TEST(PngDecoder, FewBitsOfGreySpanTheWholeRange) {
  const auto one = DecodedPng(PngOfRow(4, 1, 0, "\xa0"));  // 1010
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_THAT(one->values, ElementsAre(255, 0, 255, 0));
  const auto two = DecodedPng(PngOfRow(4, 2, 0, "\x1b"));  // 0, 1, 2, 3
  ASSERT_TRUE(two.ok()) << two.status();
  EXPECT_EQ(two->channels, 1);
  EXPECT_THAT(two->values, ElementsAre(0, 85, 170, 255));
}

TEST(PngDecoder, AlphaIsLeftOut) {
  const auto image = DecodedPng(PngOfRow(2, 8, 6, std::string("\x01\x02\x03\x00\x04\x05\x06\xff", 8)));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->channels, 3);
  EXPECT_THAT(image->values, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(PngDecoder, SixteenBitsComeWithTheUpperByteFirst) {
  const auto image = DecodedPng(PngOfRow(3, 16, 0, std::string("\xff\xff\x80\x80\x00\x00", 6)));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_THAT(image->values, ElementsAre(255, 128, 0));
}

TEST(PngDecoder, NoBeginningOfAFileIsTakenForTheWhole) {
  const std::string whole = PngOfRow(2, 8, 0, "ab");
  ASSERT_TRUE(DecodedPng(whole).ok());
  for (size_t size = 0; size < whole.size(); ++size) {
    const absl::Status status = DecodedPng(whole.substr(0, size)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << size;
    EXPECT_THAT(std::string(status.message()), HasSubstr("damaged or truncated")) << size;
  }
}

TEST(PngDecoder, AWrongChecksumHarmsWhatMakesThePixelsAlone) {
  const std::string text = PngChunk("tEXt", std::string("Author\0x", 8));
  const std::string file = PngOfRow(2, 8, 0, "ab", text);
  const auto with_flipped = [&file](const std::string& kind) {
    std::string damaged = file;
    char& byte = damaged[damaged.find(kind) + kind.size()];
    byte = static_cast<char>(byte ^ 1);
    return DecodedPng(damaged);
  };
  const auto with_text = with_flipped("tEXt");
  ASSERT_TRUE(with_text.ok()) << with_text.status();
  EXPECT_THAT(with_text->values, ElementsAre('a', 'b'));
  EXPECT_EQ(with_flipped("IHDR").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(with_flipped("IDAT").status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
