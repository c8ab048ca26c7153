// TIFF files of the kinds that programs write, made by libtiff directly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include "capture/image/image_decoders.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int kSide = 32;

// A colour that differs from pixel to pixel.
uint8_t ValueAt(int x, int y, int channel) { return static_cast<uint8_t>(7 * x + 3 * y + 50 * channel); }

struct Kind {
  const char* name;
  int channels = 3;
  int bits = 8;
  int planes = PLANARCONFIG_CONTIG;
  bool tiled = false;
  int compression = COMPRESSION_NONE;
  int format = SAMPLEFORMAT_UINT;
};

void SetFields(TIFF* tiff, const Kind& kind) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kSide);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kSide);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.channels);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.format);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planes);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  if (kind.channels == 4) {
    const uint16_t alpha = EXTRASAMPLE_ASSOCALPHA;
    TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  }
  if (kind.tiled) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 5);
  }
}

void Put(std::vector<uint8_t>& out, int value, int bits) {
  out.push_back(static_cast<uint8_t>(value));
  if (bits == 16) out.push_back(static_cast<uint8_t>(value));  // 257 times the value of 8 bits
}

// Rows `y0` to `y1` of columns `x0` to `x1`, all channels or one.
std::vector<uint8_t> Block(const Kind& kind, int x0, int y0, int x1, int y1, int channel) {
  std::vector<uint8_t> block;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      for (int c = 0; c < kind.channels; ++c)
        if (channel < 0 || channel == c) Put(block, c == 3 ? 255 : ValueAt(x, y, c), kind.bits);
  return block;
}

std::string Written(const std::string& path, const Kind& kind) {
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  SetFields(tiff, kind);
  const bool apart = kind.planes == PLANARCONFIG_SEPARATE;
  for (int c = apart ? 0 : -1; c < (apart ? kind.channels : 0); ++c) {
    const uint16_t plane = static_cast<uint16_t>(std::max(0, c));
    for (int y = 0; y < kSide; y += kind.tiled ? 16 : 1) {
      if (!kind.tiled) {
        std::vector<uint8_t> row = Block(kind, 0, y, kSide, y + 1, c);
        TIFFWriteScanline(tiff, row.data(), static_cast<uint32_t>(y), plane);
        continue;
      }
      for (int x = 0; x < kSide; x += 16) {
        std::vector<uint8_t> tile = Block(kind, x, y, x + 16, y + 16, c);
        TIFFWriteTile(tiff, tile.data(), static_cast<uint32_t>(x), static_cast<uint32_t>(y), 0, plane);
      }
    }
  }
  TIFFClose(tiff);
  return ReadBytes(path);
}

absl::StatusOr<DecodedImage> Decoded(const std::string& bytes) {
  return DecodeTiff({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, kSide * kSide);
}

const Kind kKinds[] = {{.name = "grey", .channels = 1},
                       {.name = "deep grey", .channels = 1, .bits = 16},
                       {.name = "colour"},
                       {.name = "deep colour", .bits = 16},
                       {.name = "alpha", .channels = 4},
                       {.name = "planes", .planes = PLANARCONFIG_SEPARATE},
                       {.name = "deep planes", .bits = 16, .planes = PLANARCONFIG_SEPARATE},
                       {.name = "tiles", .tiled = true},
                       {.name = "deep tiles", .bits = 16, .tiled = true},
                       {.name = "LZW", .compression = COMPRESSION_LZW},
                       {.name = "Deflate", .compression = COMPRESSION_ADOBE_DEFLATE},
                       {.name = "PackBits", .compression = COMPRESSION_PACKBITS}};

TEST(TiffDecoder, ReadsEveryKindToItsPixels) {
  const TempFolder folder;
  for (const Kind& kind : kKinds) {
    const auto image = Decoded(Written(folder / "a.tif", kind));
    ASSERT_TRUE(image.ok()) << kind.name << ": " << image.status();
    ASSERT_EQ(image->channels, kind.channels == 1 ? 1 : 3) << kind.name;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        for (int c = 0; c < image->channels; ++c)
          ASSERT_EQ(image->values[static_cast<size_t>((y * kSide + x) * image->channels + c)],
                    ValueAt(x, y, c))
              << kind.name << " at " << x << ", " << y;
  }
}

TEST(TiffDecoder, RefusesEveryKindCutAnywhere) {
  const TempFolder folder;
  for (const Kind& kind : kKinds) {
    const std::string whole = Written(folder / "a.tif", kind);
    for (size_t size = 0; size < whole.size(); size += 1 + whole.size() / 37) {
      const auto image = Decoded(whole.substr(0, size));
      EXPECT_EQ(image.status().code(), absl::StatusCode::kInvalidArgument) << kind.name << " cut to " << size;
    }
  }
}

TEST(TiffDecoder, RefusesValuesThatAreNoWholeNumbers) {
  const TempFolder folder;
  const auto image =
      Decoded(Written(folder / "a.tif", {.name = "float", .bits = 16, .format = SAMPLEFORMAT_IEEEFP}));
  EXPECT_THAT(std::string(image.status().message()), HasSubstr("whole numbers of 8 or 16 bits"));
}

// The value of a tag of the first directory, a short or a long, in a little-endian file.
std::string WithTag(std::string file, int tag, uint32_t value) {
  const auto at = [&file](size_t i) { return static_cast<uint8_t>(file[i]); };
  const size_t directory = at(4) | at(5) << 8 | at(6) << 16;
  for (size_t entry = directory + 2; entry + 12 <= file.size(); entry += 12) {
    if ((at(entry) | at(entry + 1) << 8) != tag) continue;
    for (size_t i = 0; i < 4; ++i) file[entry + 8 + i] = static_cast<char>(value >> 8 * i);
    return file;
  }
  ADD_FAILURE() << "no tag " << tag;
  return file;
}

TEST(TiffDecoder, RefusesSizesThatWouldFillTheMemory) {
  const TempFolder folder;
  const std::string whole = Written(folder / "a.tif", {.name = "LZW", .compression = COMPRESSION_LZW});
  EXPECT_THAT(std::string(Decoded(WithTag(whole, TIFFTAG_IMAGELENGTH, 0x7fffffff)).status().message()),
              HasSubstr("more than the 1024 pixels"));
  EXPECT_EQ(Decoded(WithTag(whole, TIFFTAG_IMAGEWIDTH, 0)).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(
      std::string(Decoded(Written(folder / "a.tif", {.name = "six", .channels = 6})).status().message()),
      HasSubstr("6 channels, expected 1, 3 or 4"));
}

}  // namespace
}  // namespace weft
