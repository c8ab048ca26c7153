// TIFF files by the entries of their directory (TIFF 6.0, section 2).
#include <gtest/gtest.h>

#include <map>

#include "capture/image/image_decoders.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

// Little-endian bytes of a file.
uint32_t TiffNumber(const std::vector<uint8_t>& file, size_t at, int size) {
  uint32_t value = 0;
  for (int k = 0; k < size; ++k)
    value |= static_cast<uint32_t>(file.at(at + static_cast<size_t>(k))) << (8 * k);
  return value;
}

// By tag: the first two bytes of the value, or where it stands.
std::map<uint32_t, uint32_t> DirectoryOf(const std::vector<uint8_t>& file) {
  EXPECT_EQ(file.at(0), 'I');
  EXPECT_EQ(TiffNumber(file, 2, 2), 42u);
  const size_t directory = TiffNumber(file, 4, 4);
  std::map<uint32_t, uint32_t> values;
  for (uint32_t k = 0; k < TiffNumber(file, directory, 2); ++k) {
    const size_t entry = directory + 2 + 12 * k;
    const bool is_short = TiffNumber(file, entry + 2, 2) == 3 && TiffNumber(file, entry + 4, 4) == 1;
    values[TiffNumber(file, entry, 2)] = TiffNumber(file, entry + 8, is_short ? 2 : 4);
  }
  return values;
}

constexpr uint32_t kWidthTag = 256, kHeightTag = 257, kPhotometricTag = 262, kSamplesTag = 277, kXTag = 282,
                   kYTag = 283, kUnitTag = 296;

TEST(TiffEncoder, DirectoryTellsSizeAndKind) {
  const std::vector<uint8_t> bytes(5 * 3 * 3);
  auto colour = DirectoryOf(*EncodeTiff({5, 3, 3, 8, bytes}));
  EXPECT_EQ(colour[kWidthTag], 5u);
  EXPECT_EQ(colour[kHeightTag], 3u);
  EXPECT_EQ(colour[kSamplesTag], 3u);
  EXPECT_EQ(colour[kPhotometricTag], 2u);  // RGB
  auto grey = DirectoryOf(*EncodeTiff({5, 9, 1, 8, bytes}));
  EXPECT_EQ(grey[kSamplesTag], 1u);
  EXPECT_EQ(grey[kPhotometricTag], 1u);  // black is zero
}

TEST(TiffEncoder, ResolutionIsInDotsPerInchWhereItIsKnown) {
  const std::vector<uint8_t> bytes(4);
  const std::vector<uint8_t> file = *EncodeTiff({2, 2, 1, 8, bytes}, 300);
  auto known = DirectoryOf(file);
  EXPECT_EQ(known[kUnitTag], 2u);  // inches
  for (const uint32_t tag : {kXTag, kYTag})
    EXPECT_EQ(TiffNumber(file, known[tag], 4) / double(TiffNumber(file, known[tag] + 4, 4)), 300);
  const auto unknown = DirectoryOf(*EncodeTiff({2, 2, 1, 8, bytes}));
  EXPECT_FALSE(unknown.contains(kXTag));
  EXPECT_FALSE(unknown.contains(kYTag));
}

TEST(TiffEncoder, ManyStripsComeBackTheSame) {
  std::vector<uint8_t> bytes;
  for (uint64_t i = 0; i < 400 * 300; ++i) bytes.push_back(static_cast<uint8_t>(i * i / 7));
  const std::vector<uint8_t> before = bytes;
  const auto file = EncodeTiff({400, 300, 1, 8, bytes});
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(bytes, before);  // libtiff predicts in place
  const auto read = DecodeTiff(*file, 400 * 300);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->values, bytes);
}

}  // namespace
}  // namespace weft
