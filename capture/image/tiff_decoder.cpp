#include <algorithm>
#include <array>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/grey_levels.h"
#include "capture/image/image_decoders.h"
#include "capture/image/tiff_file.h"
#include "capture/image/tiff_picture.h"

namespace weft {
namespace {

constexpr int kMostSamples = 4;

struct TiffLayout {
  uint32_t width_px = 0, height_px = 0, tile_width_px = 0, tile_height_px = 0;
  uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, planes = PLANARCONFIG_CONTIG,
           photometric = PHOTOMETRIC_MINISBLACK, compression = COMPRESSION_NONE;
  int alphas = 0;  // of the samples
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
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &layout.compression);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &layout.photometric);
  uint16_t extras = 0;
  const uint16_t* kinds = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_EXTRASAMPLES, &extras, &kinds) == 1 && kinds != nullptr)
    layout.alphas = static_cast<int>(
        std::count_if(kinds, kinds + extras, [](uint16_t kind) { return kind != EXTRASAMPLE_UNSPECIFIED; }));
  layout.tiled = TIFFIsTiled(tiff) != 0;
  if (!layout.tiled) return layout;
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &layout.tile_width_px);
  TIFFGetField(tiff, TIFFTAG_TILELENGTH, &layout.tile_height_px);
  return layout;
}

absl::Status Damaged(const std::string& problem) {
  return absl::InvalidArgumentError(
      absl::StrCat("the TIFF image is damaged or truncated (", problem, "); copy the file again"));
}

absl::Status NotRead(const std::string& what) {
  return absl::InvalidArgumentError(
      absl::StrCat("a TIFF image of ", what, " is not read; write RGB or grey of 8 or 16 bits"));
}

absl::Status CheckValues(const TiffLayout& layout) {
  const std::string bits = absl::StrCat(layout.bits, layout.bits == 1 ? " bit" : " bits");
  const char* kind = layout.format == SAMPLEFORMAT_IEEEFP ? ", floating-point"
                     : layout.format == SAMPLEFORMAT_INT  ? " with a sign"
                     : layout.format == SAMPLEFORMAT_UINT ? ""
                     : layout.format == SAMPLEFORMAT_VOID ? ""
                                                          : ", complex";
  if ((layout.bits == 8 || layout.bits == 16) && kind[0] == '\0') return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("values of ", bits, kind, "; only whole numbers of 8 or 16 bits without a sign are read"));
}

// How many stored values of a pixel are its grey or colour, the first ones; 0: libtiff is to convert them.
absl::StatusOr<int> StoredChannels(const TiffLayout& layout) {
  switch (layout.photometric) {
    case PHOTOMETRIC_RGB:
      if (layout.samples >= 3) return 3;
      return NotRead(absl::StrCat("RGB with ", layout.samples, " values a pixel"));
    case PHOTOMETRIC_MINISBLACK:
      return layout.samples - layout.alphas >= 3 ? 3 : 1;
    case PHOTOMETRIC_MINISWHITE:
      if (layout.samples - layout.alphas < 3) return 1;
      return NotRead("grey from white to black with several channels");
    case PHOTOMETRIC_CFA:
      if (layout.samples == 1) return 1;
      return NotRead(absl::StrCat("a mosaic with ", layout.samples, " values a pixel"));
    case PHOTOMETRIC_PALETTE:
    case PHOTOMETRIC_SEPARATED:
    case PHOTOMETRIC_YCBCR:
    case PHOTOMETRIC_CIELAB:
    case PHOTOMETRIC_ICCLAB:
    case PHOTOMETRIC_ITULAB:
      return 0;
    default:
      return NotRead(absl::StrCat("photometric interpretation ", layout.photometric));
  }
}

absl::Status CheckCompression(const TiffLayout& layout) {
  if (TIFFIsCODECConfigured(layout.compression) != 0) return absl::OkStatus();
  const TIFFCodec* codec = TIFFFindCODEC(layout.compression);
  return NotRead(absl::StrCat("compression ", layout.compression,
                              codec == nullptr ? "" : absl::StrCat(" (", codec->name, ")")));
}

// The order of a Bayer mosaic (TIFF/EP: CFARepeatPatternDim, CFAPattern); none where the file names none.
absl::StatusOr<std::optional<PixelFormat>> MosaicOrder(TIFF* tiff) {
  const uint16_t* sides = nullptr;
  const uint8_t* colours = nullptr;
  uint16_t count = 0;
  if (TIFFGetField(tiff, TIFFTAG_CFAPATTERN, &count, &colours) != 1 || colours == nullptr)
    return std::nullopt;
  const bool has_sides = TIFFGetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, &sides) == 1 && sides != nullptr;
  const bool is_2x2 = count == 4 && (!has_sides || (sides[0] == 2 && sides[1] == 2));
  constexpr std::pair<std::array<uint8_t, 4>, PixelFormat> kOrders[] = {
      {{0, 1, 1, 2}, PixelFormat::kBayerRg8},  // red, green, blue are 0, 1, 2
      {{1, 0, 2, 1}, PixelFormat::kBayerGr8},
      {{1, 2, 0, 1}, PixelFormat::kBayerGb8},
      {{2, 1, 1, 0}, PixelFormat::kBayerBg8}};
  for (const auto& [order, format] : kOrders) {
    if (is_2x2 && std::memcmp(colours, order.data(), order.size()) == 0) return format;
  }
  return NotRead("a mosaic other than Bayer's");
}

uint16_t Value(const uint8_t* row, size_t i, int bits) {
  return bits == 8 ? row[i] : reinterpret_cast<const uint16_t*>(row)[i];
}

// Values as they stand in the file, rows or tiles, of a pixel together or in planes.
class StoredValues {
 public:
  StoredValues(TIFF* tiff, const TiffLayout& layout, DecodedImage& image)
      : tiff_(tiff), layout_(layout), image_(image), values_(image.values.size()) {}

  bool Read() {
    const bool together = layout_.planes == PLANARCONFIG_CONTIG;
    for (int plane = 0; plane < (together ? 1 : image_.channels); ++plane) {
      if (!(layout_.tiled ? ReadTiles(plane) : ReadRows(plane))) return false;
    }
    if (layout_.bits == 8) {
      std::copy(values_.begin(), values_.end(), image_.values.begin());
    } else {
      image_.values = ToEightBits(values_);
    }
    if (layout_.photometric != PHOTOMETRIC_MINISWHITE) return true;
    for (uint8_t& value : image_.values) value = static_cast<uint8_t>(255 - value);
    return true;
  }

 private:
  bool ReadRows(int plane) {
    const uint8_t* row = Room(TIFFScanlineSize64(tiff_));
    if (row == nullptr) return false;
    for (uint32_t y = 0; y < layout_.height_px; ++y) {
      if (TIFFReadScanline(tiff_, room_.data(), y, static_cast<uint16_t>(plane)) < 0) return false;
      Put(row, 0, y, layout_.width_px, plane);
    }
    return true;
  }
  bool ReadTiles(int plane) {
    const uint32_t width_px = layout_.tile_width_px, height_px = layout_.tile_height_px;
    const uint8_t* tile = Room(TIFFTileSize64(tiff_));
    if (tile == nullptr || width_px == 0 || height_px == 0) return false;
    const uint64_t row_bytes = TIFFTileRowSize64(tiff_);
    for (uint64_t y = 0; y < layout_.height_px; y += height_px) {
      for (uint64_t x = 0; x < layout_.width_px; x += width_px) {
        const auto x_px = static_cast<uint32_t>(x), y_px = static_cast<uint32_t>(y);
        if (TIFFReadTile(tiff_, room_.data(), x_px, y_px, 0, static_cast<uint16_t>(plane)) < 0) return false;
        const uint32_t columns = std::min(width_px, layout_.width_px - x_px);
        const uint32_t rows = std::min(height_px, layout_.height_px - y_px);
        for (uint32_t row = 0; row < rows; ++row)
          Put(tile + row * row_bytes, x_px, y_px + row, columns, plane);
      }
    }
    return true;
  }
  // Null for sizes that a damaged file made up: tiles are little larger than their picture.
  const uint8_t* Room(uint64_t bytes) {
    constexpr uint64_t kSpareBytes = uint64_t{64} << 20;
    const uint64_t pixels = uint64_t{layout_.width_px} * layout_.height_px;
    if (bytes == 0 || bytes > 2 * kMostSamples * pixels + kSpareBytes) return nullptr;
    room_.resize(static_cast<size_t>(bytes) / 2 + 1);  // aligned
    return reinterpret_cast<const uint8_t*>(room_.data());
  }
  // A row of pixels from column `x` on.
  void Put(const uint8_t* from, size_t x, size_t y, size_t count, int plane) {
    const size_t channels = static_cast<size_t>(image_.channels);
    uint16_t* out = values_.data() + (y * layout_.width_px + x) * channels;
    if (layout_.planes != PLANARCONFIG_CONTIG) {
      for (size_t i = 0; i < count; ++i) out[i * channels + plane] = Value(from, i, layout_.bits);
      return;
    }
    for (size_t i = 0; i < count; ++i)
      for (size_t c = 0; c < channels; ++c) *out++ = Value(from, i * layout_.samples + c, layout_.bits);
  }

  TIFF* tiff_;
  const TiffLayout& layout_;
  DecodedImage& image_;
  std::vector<uint16_t> room_;
  std::vector<uint16_t> values_;  // as image_'s
};

// Palettes and colour spaces, by libtiff's own conversion to 8 bits. Its orientation is set aside.
absl::Status ReadConverted(TIFF* tiff, const TiffLayout& layout, const std::string& problem,
                           DecodedImage& image) {
  TIFFRGBAImage converter;
  char why[1024] = "";
  constexpr int kStopOnError = 1;
  if (TIFFRGBAImageOK(tiff, why) == 0 || TIFFRGBAImageBegin(&converter, tiff, kStopOnError, why) == 0)
    return NotRead(absl::StrCat("this kind (", why, ")"));
  std::vector<uint32_t> packed(size_t{layout.width_px} * layout.height_px);
  converter.orientation = converter.req_orientation = ORIENTATION_TOPLEFT;
  const bool read = TIFFRGBAImageGet(&converter, packed.data(), layout.width_px, layout.height_px) != 0;
  TIFFRGBAImageEnd(&converter);
  if (!read) return Damaged(problem);
  uint8_t* out = image.values.data();
  for (const uint32_t pixel : packed) {
    *out++ = static_cast<uint8_t>(TIFFGetR(pixel));
    *out++ = static_cast<uint8_t>(TIFFGetG(pixel));
    *out++ = static_cast<uint8_t>(TIFFGetB(pixel));
  }
  return absl::OkStatus();
}

absl::Status CheckLayout(const TiffLayout& layout, int64_t most_pixels) {
  WEFT_RETURN_IF_ERROR(CheckValues(layout));
  if (layout.samples == 0 || layout.samples > kMostSamples)
    return absl::InvalidArgumentError(absl::StrCat(layout.samples, " channels, expected 1, 3 or 4"));
  if (layout.width_px == 0 || int64_t{layout.width_px} * layout.height_px > most_pixels) {
    return absl::InvalidArgumentError(absl::StrCat("image is ", layout.width_px, "x", layout.height_px,
                                                   ", more than the ", most_pixels, " pixels that are read"));
  }
  return CheckCompression(layout);
}

}  // namespace

absl::StatusOr<DecodedImage> DecodeTiff(std::span<const uint8_t> bytes, int64_t most_pixels) {
  TiffMemory memory;
  memory.data = bytes.data();
  memory.size = bytes.size();
  const TiffHandle tiff = OpenTiff(memory);
  if (!tiff) return Damaged(memory.problem);
  WEFT_RETURN_IF_ERROR(FindTiffPicture(tiff.get()).status());
  if (!memory.problem.empty()) return Damaged(memory.problem);
  const TiffLayout layout = LayoutOf(tiff.get());
  WEFT_RETURN_IF_ERROR(CheckLayout(layout, most_pixels));
  WEFT_ASSIGN_OR_RETURN(const int stored, StoredChannels(layout));
  DecodedImage image{
      static_cast<int>(layout.width_px), static_cast<int>(layout.height_px), stored > 0 ? stored : 3, {}};
  image.is_mosaic = layout.photometric == PHOTOMETRIC_CFA;
  if (image.is_mosaic) {
    WEFT_ASSIGN_OR_RETURN(const std::optional<PixelFormat> order, MosaicOrder(tiff.get()));
    image.mosaic = order;
  }
  image.values.resize(size_t{layout.width_px} * layout.height_px * image.channels);
  if (stored == 0) {
    WEFT_RETURN_IF_ERROR(ReadConverted(tiff.get(), layout, memory.problem, image));
  } else if (!StoredValues(tiff.get(), layout, image).Read()) {
    return Damaged(memory.problem);
  }
  if (!memory.problem.empty()) return Damaged(memory.problem);
  return image;
}

}  // namespace weft
