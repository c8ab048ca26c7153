#include "absl/strings/str_cat.h"
#include "capture/image/image_decoders.h"
#include "capture/image/tiff_file.h"

namespace weft {
namespace {

struct TiffLayout {
  uint32_t width_px = 0, height_px = 0;
  uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, planes = PLANARCONFIG_CONTIG,
           photometric = PHOTOMETRIC_MINISBLACK;
  bool tiled = false;
};

TiffLayout LayoutOf(TIFF* tiff) {
  TiffLayout layout;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &layout.width_px);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &layout.height_px);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &layout.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &layout.samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &layout.format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &layout.planes);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &layout.photometric);
  layout.tiled = TIFFIsTiled(tiff) != 0;
  return layout;
}

// Rows of values as they stand in the file, the common kind: grey or colour, values of a pixel together.
bool HasPlainRows(const TiffLayout& layout) {
  const bool plain_colour = layout.photometric == PHOTOMETRIC_RGB && layout.samples >= 3;
  const bool plain_grey = layout.photometric == PHOTOMETRIC_MINISBLACK && layout.samples == 1;
  return !layout.tiled && layout.planes == PLANARCONFIG_CONTIG && (plain_colour || plain_grey);
}

uint8_t Value(const uint8_t* row, size_t i, int bits) {
  if (bits == 8) return row[i];
  const int value = reinterpret_cast<const uint16_t*>(row)[i];
  return static_cast<uint8_t>((value + 128) / 257);
}

bool ReadRows(TIFF* tiff, const TiffLayout& layout, DecodedImage& image) {
  std::vector<uint16_t> room(static_cast<size_t>(TIFFScanlineSize(tiff)) / 2 + 1);  // aligned
  const uint8_t* row = reinterpret_cast<const uint8_t*>(room.data());
  const size_t channels = static_cast<size_t>(image.channels);
  uint8_t* out = image.values.data();
  for (uint32_t y = 0; y < layout.height_px; ++y) {
    if (TIFFReadScanline(tiff, room.data(), y, 0) < 0) return false;
    for (size_t x = 0; x < layout.width_px; ++x)
      for (size_t c = 0; c < channels; ++c) *out++ = Value(row, x * layout.samples + c, layout.bits);
  }
  return true;
}

// Tiles, planes, palettes and colour spaces, by libtiff's own conversion.
bool ReadConverted(TIFF* tiff, const TiffLayout& layout, DecodedImage& image) {
  const size_t pixels = size_t{layout.width_px} * layout.height_px;
  std::vector<uint32_t> packed(pixels);
  constexpr int kStopOnError = 1;
  if (TIFFReadRGBAImageOriented(tiff, layout.width_px, layout.height_px, packed.data(), ORIENTATION_TOPLEFT,
                                kStopOnError) == 0)
    return false;
  uint8_t* out = image.values.data();
  for (const uint32_t pixel : packed) {
    *out++ = static_cast<uint8_t>(TIFFGetR(pixel));
    if (image.channels == 1) continue;
    *out++ = static_cast<uint8_t>(TIFFGetG(pixel));
    *out++ = static_cast<uint8_t>(TIFFGetB(pixel));
  }
  return true;
}

absl::Status Damaged(const std::string& problem) {
  return absl::InvalidArgumentError(
      absl::StrCat("the TIFF image is damaged or truncated (", problem, "); copy the file again"));
}

}  // namespace

absl::StatusOr<DecodedImage> DecodeTiff(std::span<const uint8_t> bytes, int64_t most_pixels) {
  TiffMemory memory;
  memory.data = bytes.data();
  memory.size = bytes.size();
  const TiffHandle tiff = OpenTiff(memory);
  if (!tiff) return Damaged(memory.problem);
  const TiffLayout layout = LayoutOf(tiff.get());
  if ((layout.bits != 8 && layout.bits != 16) || layout.format != SAMPLEFORMAT_UINT)
    return absl::InvalidArgumentError(absl::StrCat(
        "values of ", layout.bits, layout.format == SAMPLEFORMAT_UINT ? " bits" : " bits with a sign",
        "; only whole numbers of 8 or 16 bits without a sign are read"));
  if (layout.samples > 4)
    return absl::InvalidArgumentError(absl::StrCat(layout.samples, " channels, expected 1, 3 or 4"));
  if (layout.width_px == 0 || int64_t{layout.width_px} * layout.height_px > most_pixels) {
    return absl::InvalidArgumentError(absl::StrCat("image is ", layout.width_px, "x", layout.height_px,
                                                   ", more than the ", most_pixels, " pixels that are read"));
  }
  const bool grey =
      layout.photometric == PHOTOMETRIC_MINISBLACK || layout.photometric == PHOTOMETRIC_MINISWHITE;
  DecodedImage image{static_cast<int>(layout.width_px), static_cast<int>(layout.height_px), grey ? 1 : 3, {}};
  image.values.resize(size_t{layout.width_px} * layout.height_px * (grey ? 1 : 3));
  const bool read =
      HasPlainRows(layout) ? ReadRows(tiff.get(), layout, image) : ReadConverted(tiff.get(), layout, image);
  if (!read || !memory.problem.empty()) return Damaged(memory.problem);
  return image;
}

}  // namespace weft
