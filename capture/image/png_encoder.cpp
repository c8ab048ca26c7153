#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

// What libpng's callbacks know of the file.
struct Sink {
  std::vector<uint8_t>* bytes;
  char problem[160];
};

extern "C" [[noreturn]] void WeftPngWriteError(png_structp png, png_const_charp message) {
  Sink& sink = *static_cast<Sink*>(png_get_error_ptr(png));
  std::snprintf(sink.problem, sizeof(sink.problem), "%s", message);
  png_longjmp(png, 1);
}

extern "C" void WeftPngWriteWarning(png_structp, png_const_charp) {}

extern "C" void WeftPngWrite(png_structp png, png_bytep in, size_t size) {
  std::vector<uint8_t>& bytes = *static_cast<Sink*>(png_get_io_ptr(png))->bytes;
  bytes.insert(bytes.end(), in, in + size);
}

extern "C" void WeftPngFlush(png_structp) {}

int ColorType(int channels) {
  if (channels == 1) return PNG_COLOR_TYPE_GRAY;
  return channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA;
}

// One file. No function that longjmp may leave owns anything but this.
class PngWriter {
 public:
  explicit PngWriter(std::vector<uint8_t>* bytes) : sink_{bytes, "out of memory"} {
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, &sink_, WeftPngWriteError, WeftPngWriteWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  // False: see problem().
  bool Write(const ImagePixels& image, PngEffort effort) {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_write_fn(png_, &sink_, WeftPngWrite, WeftPngFlush);
    if (effort == PngEffort::kFast) {
      // As OpenCV tunes it: one filter, runs instead of a search for matches.
      png_set_filter(png_, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
      png_set_compression_level(png_, Z_BEST_SPEED);
      png_set_compression_strategy(png_, Z_RLE);
    }
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(image.width_px),
                 static_cast<png_uint_32>(image.height_px), image.bits, ColorType(image.channels),
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png_, info_);
    if (image.bits == 16) png_set_swap(png_);
    const size_t row_bytes = image.bytes.size() / static_cast<size_t>(image.height_px);
    for (int y = 0; y < image.height_px; ++y) png_write_row(png_, image.bytes.data() + row_bytes * y);
    png_write_end(png_, info_);
    return true;
  }
  const char* problem() const { return sink_.problem; }

 private:
  Sink sink_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

absl::StatusOr<std::vector<uint8_t>> EncodePng(const ImagePixels& image, PngEffort effort) {
  WEFT_RETURN_IF_ERROR(CheckPixels(image, 4, 16));
  std::vector<uint8_t> bytes;
  PngWriter writer(&bytes);
  if (!writer.Write(image, effort))
    return absl::InternalError(absl::StrCat("the image cannot be encoded as PNG: ", writer.problem()));
  return bytes;
}

}  // namespace weft
