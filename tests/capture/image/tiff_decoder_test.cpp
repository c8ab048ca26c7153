// TIFF files of the kinds that programs write, made by libtiff directly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include "absl/strings/str_cat.h"
#include "capture/image/image_decoders.h"
#include "capture/image/image_file.h"
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
  int photometric = -1;  // by the channels
  int orientation = 0;   // not said
  int alpha = EXTRASAMPLE_ASSOCALPHA;
  int alpha_value = 255;
  int subfile = 0;
  int side = kSide;
};

void SetFields(TIFF* tiff, const Kind& kind) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kind.side);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kind.side);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.channels);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.format);
  const int by_channels = kind.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB;
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric < 0 ? by_channels : kind.photometric);
  if (kind.orientation > 0) TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
  if (kind.subfile > 0) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, kind.subfile);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planes);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  if (kind.channels == 4 && kind.alpha >= 0) {
    const uint16_t alpha = static_cast<uint16_t>(kind.alpha);
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
        if (channel < 0 || channel == c) Put(block, c == 3 ? kind.alpha_value : ValueAt(x, y, c), kind.bits);
  return block;
}

void WriteTiffImage(TIFF* tiff, const Kind& kind) {
  SetFields(tiff, kind);
  const bool apart = kind.planes == PLANARCONFIG_SEPARATE;
  for (int c = apart ? 0 : -1; c < (apart ? kind.channels : 0); ++c) {
    const uint16_t plane = static_cast<uint16_t>(std::max(0, c));
    for (int y = 0; y < kind.side; y += kind.tiled ? 16 : 1) {
      if (!kind.tiled) {
        std::vector<uint8_t> row = Block(kind, 0, y, kind.side, y + 1, c);
        TIFFWriteScanline(tiff, row.data(), static_cast<uint32_t>(y), plane);
        continue;
      }
      for (int x = 0; x < kind.side; x += 16) {
        std::vector<uint8_t> tile = Block(kind, x, y, x + 16, y + 16, c);
        TIFFWriteTile(tiff, tile.data(), static_cast<uint32_t>(x), static_cast<uint32_t>(y), 0, plane);
      }
    }
  }
}

// A file of these images, one after the other.
std::string Written(const std::string& path, const std::vector<Kind>& images, const char* mode = "w") {
  TIFF* tiff = TIFFOpen(path.c_str(), mode);
  for (const Kind& kind : images) {
    WriteTiffImage(tiff, kind);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return ReadBytes(path);
}

std::string Written(const std::string& path, const Kind& kind) { return Written(path, std::vector{kind}); }

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

// All pixels as they were written, from the top left one on.
void ExpectStored(const DecodedImage& image, int channels, int side, const std::string& what) {
  ASSERT_EQ(image.channels, channels) << what;
  ASSERT_EQ(image.width_px, side) << what;
  ASSERT_EQ(image.height_px, side) << what;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (int c = 0; c < channels; ++c)
        ASSERT_EQ(image.values[static_cast<size_t>((y * side + x) * channels + c)], ValueAt(x, y, c))
            << what << " at " << x << ", " << y;
}

TEST(TiffDecoder, ReadsEveryKindToItsPixels) {
  const TempFolder folder;
  for (const Kind& kind : kKinds) {
    const auto image = Decoded(Written(folder / "a.tif", kind));
    ASSERT_TRUE(image.ok()) << kind.name << ": " << image.status();
    ExpectStored(*image, kind.channels == 1 ? 1 : 3, kSide, kind.name);
  }
}

const Kind kShapes[] = {{.name = "rows"},
                        {.name = "tiles", .tiled = true},
                        {.name = "planes", .planes = PLANARCONFIG_SEPARATE},
                        {.name = "tiled planes", .planes = PLANARCONFIG_SEPARATE, .tiled = true}};

TEST(TiffDecoder, LeavesPixelsAsTheyAreStoredWhateverTheOrientation) {
  const TempFolder folder;
  for (Kind kind : kShapes) {
    for (kind.orientation = 1; kind.orientation <= 8; ++kind.orientation) {
      const std::string bytes = Written(folder / "a.tif", kind);
      const auto image = Decoded(bytes);
      ASSERT_TRUE(image.ok()) << image.status();
      ExpectStored(*image, 3, kSide, absl::StrCat(kind.name, ", orientation ", kind.orientation));
      EXPECT_EQ(ReadImageHeader({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()})->orientation,
                kind.orientation);
      EXPECT_EQ(ReadImageFileHeader(folder / "a.tif")->orientation, kind.orientation);
    }
  }
}

TEST(TiffDecoder, TurnsNoConvertedColoursEither) {
  const TempFolder folder;
  std::vector<uint8_t> first;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const auto image = Decoded(Written(folder / "a.tif", {.name = "inks",
                                                          .channels = 4,
                                                          .photometric = PHOTOMETRIC_SEPARATED,
                                                          .orientation = orientation,
                                                          .alpha = -1}));
    ASSERT_TRUE(image.ok()) << image.status();
    if (first.empty()) first = image->values;
    EXPECT_EQ(image->values, first) << orientation;
  }
}

TEST(TiffDecoder, LeavesAlphaOutAlike) {
  const TempFolder folder;
  for (Kind kind : kShapes) {
    for (const int alpha : {EXTRASAMPLE_UNSPECIFIED, EXTRASAMPLE_ASSOCALPHA, EXTRASAMPLE_UNASSALPHA}) {
      for (const int bits : {8, 16}) {
        kind.channels = 4;
        kind.bits = bits;
        kind.alpha = alpha;
        kind.alpha_value = 0;
        const auto image = Decoded(Written(folder / "a.tif", kind));
        ASSERT_TRUE(image.ok()) << kind.name << ": " << image.status();
        ExpectStored(*image, 3, kSide, absl::StrCat(kind.name, ", alpha ", alpha));
      }
    }
  }
}

TEST(TiffDecoder, TakesGreyOfThreeValuesForColour) {
  const TempFolder folder;
  for (Kind kind : kShapes) {
    kind.photometric = PHOTOMETRIC_MINISBLACK;
    for (const int channels : {3, 4}) {
      kind.channels = channels;
      const auto image = Decoded(Written(folder / "a.tif", kind));
      ASSERT_TRUE(image.ok()) << kind.name << ": " << image.status();
      ExpectStored(*image, 3, kSide, kind.name);
    }
  }
}

TEST(TiffDecoder, TurnsWhiteToBlackAround) {
  const TempFolder folder;
  const auto black = Decoded(Written(folder / "a.tif", {.name = "black", .channels = 1}));
  for (const bool tiled : {false, true}) {
    for (const int bits : {8, 16}) {
      const auto white = Decoded(Written(folder / "a.tif", {.name = "white",
                                                            .channels = 1,
                                                            .bits = bits,
                                                            .tiled = tiled,
                                                            .photometric = PHOTOMETRIC_MINISWHITE}));
      ASSERT_TRUE(white.ok()) << white.status();
      for (size_t i = 0; i < black->values.size(); ++i)
        ASSERT_EQ(white->values[i], 255 - black->values[i]) << tiled << " " << bits;
    }
  }
}

TEST(TiffDecoder, TakesThePictureOfFullResolution) {
  const TempFolder folder;
  const Kind picture = {.name = "picture"};
  const Kind thumbnail = {.name = "thumbnail", .subfile = FILETYPE_REDUCEDIMAGE, .side = 8};
  const Kind nearly = {.name = "nearly as large", .subfile = FILETYPE_REDUCEDIMAGE, .side = 30};
  const Kind unlabelled = {.name = "unlabelled", .side = 16};
  const Kind mask = {.name = "mask", .channels = 1, .subfile = FILETYPE_MASK};
  const std::vector<Kind> files[] = {
      {picture, thumbnail}, {thumbnail, picture},         {picture, unlabelled},     {unlabelled, picture},
      {mask, picture},      {nearly, thumbnail, picture}, {picture, mask, thumbnail}};
  for (const char* mode : {"w", "w8", "wb"}) {  // w8: BigTIFF; wb: big-endian
    for (const std::vector<Kind>& images : files) {
      const std::string bytes = Written(folder / "a.tif", images, mode);
      const auto image = Decoded(bytes);
      ASSERT_TRUE(image.ok()) << images[0].name << ": " << image.status();
      ExpectStored(*image, 3, kSide, images[0].name);
      EXPECT_EQ(ReadImageFileHeader(folder / "a.tif")->width_px, kSide);
    }
  }
  const auto alone = Decoded(Written(folder / "a.tif", thumbnail));
  ASSERT_TRUE(alone.ok()) << alone.status();
  ExpectStored(*alone, 3, 8, "alone");
}

TEST(TiffDecoder, FindsPicturesAndThumbnailsInSubDirectories) {
  const TempFolder folder;
  for (const bool picture_is_below : {false, true}) {
    const Kind picture = {.name = "picture"};
    const Kind thumbnail = {.name = "thumbnail", .subfile = FILETYPE_REDUCEDIMAGE, .side = 8};
    TIFF* tiff = TIFFOpen((folder / "a.tif").c_str(), "w");
    const uint64_t places[1] = {0};  // filled in by libtiff, which writes the next directory there
    TIFFSetField(tiff, TIFFTAG_SUBIFD, 1, places);
    WriteTiffImage(tiff, picture_is_below ? thumbnail : picture);
    TIFFWriteDirectory(tiff);
    WriteTiffImage(tiff, picture_is_below ? picture : thumbnail);
    TIFFWriteDirectory(tiff);
    TIFFClose(tiff);
    const auto image = Decoded(ReadBytes(folder / "a.tif"));
    ASSERT_TRUE(image.ok()) << image.status();
    ExpectStored(*image, 3, kSide, picture_is_below ? "below" : "above");
  }
}

TEST(TiffDecoder, RefusesSeveralPicturesInOneFile) {
  const TempFolder folder;
  const Kind picture = {.name = "picture"}, other = {.name = "other", .side = 28};
  for (const Kind& second : {picture, other}) {
    const std::string bytes = Written(folder / "a.tif", {picture, second});
    EXPECT_THAT(std::string(Decoded(bytes).status().message()), HasSubstr("write one image per file"));
    EXPECT_EQ(ReadImageFileHeader(folder / "a.tif").status().code(), absl::StatusCode::kInvalidArgument);
  }
}

// A grey file that names its mosaic; empty: it names none.
std::string Mosaic(const std::string& path, const std::vector<uint8_t>& colours, uint16_t side = 2) {
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  const uint16_t sides[2] = {side, side};
  if (!colours.empty()) {
    TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, sides);
    TIFFSetField(tiff, TIFFTAG_CFAPATTERN, static_cast<uint16_t>(colours.size()), colours.data());
  }
  WriteTiffImage(tiff, {.name = "mosaic", .channels = 1, .photometric = PHOTOMETRIC_CFA});
  TIFFClose(tiff);
  return ReadBytes(path);
}

TEST(TiffDecoder, ReadsTheOrderOfABayerMosaic) {
  const TempFolder folder;
  const struct {
    std::vector<uint8_t> colours;
    PixelFormat order;
  } kOrders[] = {{{0, 1, 1, 2}, PixelFormat::kBayerRg8},
                 {{1, 0, 2, 1}, PixelFormat::kBayerGr8},
                 {{1, 2, 0, 1}, PixelFormat::kBayerGb8},
                 {{2, 1, 1, 0}, PixelFormat::kBayerBg8}};
  for (const auto& [colours, order] : kOrders) {
    const auto image = Decoded(Mosaic(folder / "a.tif", colours));
    ASSERT_TRUE(image.ok()) << image.status();
    ExpectStored(*image, 1, kSide, "mosaic");
    EXPECT_EQ(image->mosaic, order);
    EXPECT_EQ(ReadImageFile(folder / "a.tif")->format, order);
    EXPECT_EQ(ReadImageFile(folder / "a.tif", order)->format, order);
  }
  EXPECT_THAT(std::string(ReadImageFile(folder / "a.tif", PixelFormat::kBayerRg8).status().message()),
              HasSubstr("a.tif: the file says that it is bayer_bg8, --mosaic says bayer_rg8"));
  EXPECT_THAT(std::string(Decoded(Mosaic(folder / "a.tif", {0, 1, 1, 1})).status().message()),
              HasSubstr("a mosaic other than Bayer's"));
  EXPECT_THAT(
      std::string(Decoded(Mosaic(folder / "a.tif", std::vector<uint8_t>(36, 1), 6)).status().message()),
      HasSubstr("a mosaic other than Bayer's"));
  ASSERT_FALSE(Mosaic(folder / "a.tif", {}).empty());
  EXPECT_THAT(std::string(ReadImageFile(folder / "a.tif").status().message()), HasSubstr("--mosaic"));
  EXPECT_EQ(ReadImageFile(folder / "a.tif", PixelFormat::kBayerGr8)->format, PixelFormat::kBayerGr8);
}

TEST(TiffDecoder, NamesWhatIsNotRead) {
  const TempFolder folder;
  const struct {
    Kind kind;
    const char* words;
  } kOthers[] = {
      {{.name = "sign", .bits = 16, .format = SAMPLEFORMAT_INT}, "16 bits with a sign"},
      {{.name = "float", .bits = 16, .format = SAMPLEFORMAT_IEEEFP}, "16 bits, floating-point"},
      {{.name = "white", .photometric = PHOTOMETRIC_MINISWHITE}, "from white to black with several"},
      {{.name = "mosaics", .photometric = PHOTOMETRIC_CFA}, "a mosaic with 3 values a pixel"},
      {{.name = "two", .channels = 2, .photometric = PHOTOMETRIC_RGB}, "RGB with 2 values a pixel"},
      {{.name = "depth", .channels = 1, .photometric = 51177}, "photometric interpretation 51177"},
      {{.name = "deep inks", .channels = 4, .bits = 16, .photometric = PHOTOMETRIC_SEPARATED, .alpha = -1},
       "is not read"},
  };
  for (const auto& [kind, words] : kOthers) {
    const absl::Status status = Decoded(Written(folder / "a.tif", kind)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << kind.name;
    EXPECT_THAT(std::string(status.message()), HasSubstr(words)) << kind.name;
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

TEST(TiffDecoder, NamesACompressionThatItLacks) {
  const TempFolder folder;
  const std::string whole = Written(folder / "a.tif", {.name = "LZW", .compression = COMPRESSION_LZW});
  EXPECT_THAT(std::string(Decoded(WithTag(whole, TIFFTAG_COMPRESSION, 34713)).status().message()),
              HasSubstr("compression 34713 is not read"));
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
