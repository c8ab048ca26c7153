#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/image/grey_levels.h"
#include "capture/image/image_decoders.h"

namespace weft {
namespace {

// What libpng's callbacks know of the file.
struct Source {
  std::span<const uint8_t> rest;
  char problem[160];
};

extern "C" [[noreturn]] void WeftPngError(png_structp png, png_const_charp message) {
  Source& source = *static_cast<Source*>(png_get_error_ptr(png));
  std::snprintf(source.problem, sizeof(source.problem), "%s", message);
  png_longjmp(png, 1);
}

// Odd colour profiles and the like; damage of pixels is an error, see png_set_crc_action.
extern "C" void WeftPngWarning(png_structp, png_const_charp) {}

extern "C" void WeftPngRead(png_structp png, png_bytep out, size_t size) {
  Source& source = *static_cast<Source*>(png_get_io_ptr(png));
  if (size > source.rest.size()) png_error(png, "the file ends here");
  std::memcpy(out, source.rest.data(), size);
  source.rest = source.rest.subspan(size);
}

// One file. No function that longjmp may leave owns anything but this.
class PngFile {
 public:
  explicit PngFile(std::span<const uint8_t> bytes) : source_{bytes, "out of memory"} {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &source_, WeftPngError, WeftPngWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngFile() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  // False: see problem().
  bool ReadHeader() {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, &source_, WeftPngRead);
    // Critical chunks make the pixels; a damaged one of metadata is left out.
    png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_WARN_DISCARD);
    png_read_info(png_, info_);
    const int color = png_get_color_type(png_, info_);
    if (color == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (color == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png_);
    if (color == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(png_);
    png_set_strip_alpha(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }
  // `rows`: a pointer to room for row_bytes() bytes per line of the image.
  bool ReadPixels(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  int width_px() const { return static_cast<int>(png_get_image_width(png_, info_)); }
  int height_px() const { return static_cast<int>(png_get_image_height(png_, info_)); }
  int channels() const { return png_get_channels(png_, info_); }
  int bits() const { return png_get_bit_depth(png_, info_); }
  size_t row_bytes() const { return png_get_rowbytes(png_, info_); }
  const char* problem() const { return source_.problem; }

 private:
  Source source_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

// Pairs of bytes, the upper one first.
std::vector<uint16_t> Words(const std::vector<uint8_t>& bytes) {
  std::vector<uint16_t> words(bytes.size() / 2);
  for (size_t i = 0; i < words.size(); ++i)
    words[i] = static_cast<uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]);
  return words;
}

absl::Status DamagedPng(const char* problem) {
  return absl::InvalidArgumentError(
      absl::StrCat("the PNG image is damaged or truncated (", problem, "); copy the file again"));
}

}  // namespace

absl::StatusOr<DecodedImage> DecodePng(std::span<const uint8_t> bytes) {
  PngFile file(bytes);
  if (!file.ReadHeader()) return DamagedPng(file.problem());
  DecodedImage image{file.width_px(), file.height_px(), file.channels(), {}};
  if ((image.channels != 1 && image.channels != 3) || (file.bits() != 8 && file.bits() != 16))
    return absl::InvalidArgumentError("only 8 and 16 bit images of 1, 3 or 4 channels are supported");
  image.values.resize(file.row_bytes() * static_cast<size_t>(image.height_px));
  std::vector<png_bytep> rows;
  for (int y = 0; y < image.height_px; ++y) rows.push_back(image.values.data() + file.row_bytes() * y);
  if (!file.ReadPixels(rows.data())) return DamagedPng(file.problem());
  if (file.bits() == 16) image.values = ToEightBits(Words(image.values));
  return image;
}

}  // namespace weft
