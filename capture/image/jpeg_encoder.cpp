#include <csetjmp>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"

namespace weft {
namespace {

// libjpeg's error manager: errors jump back.
struct EncodeErrors {
  jpeg_error_mgr manager;  // first, libjpeg knows the others by it
  std::jmp_buf jump;
  char problem[JMSG_LENGTH_MAX];
};

extern "C" void WeftJpegWriteError(j_common_ptr info) {
  EncodeErrors& errors = *reinterpret_cast<EncodeErrors*>(info->err);
  info->err->format_message(info, errors.problem);
  std::longjmp(errors.jump, 1);
}

// One file. No function that longjmp may leave owns anything but this.
class JpegWriter {
 public:
  JpegWriter() {
    info_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = WeftJpegWriteError;
    errors_.problem[0] = '\0';
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&info_);
    std::free(bytes_);
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  // False: see problem().
  bool Write(const ImagePixels& image, int quality) {
    if (setjmp(errors_.jump) != 0) return false;
    jpeg_create_compress(&info_);
    jpeg_mem_dest(&info_, &bytes_, &size_);
    info_.image_width = static_cast<JDIMENSION>(image.width_px);
    info_.image_height = static_cast<JDIMENSION>(image.height_px);
    info_.input_components = image.channels;
    info_.in_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&info_);
    jpeg_set_quality(&info_, quality, TRUE);
    jpeg_start_compress(&info_, TRUE);
    const size_t row_bytes = static_cast<size_t>(image.width_px) * image.channels;
    while (info_.next_scanline < info_.image_height) {
      JSAMPROW row = const_cast<uint8_t*>(image.bytes.data() + info_.next_scanline * row_bytes);
      jpeg_write_scanlines(&info_, &row, 1);
    }
    jpeg_finish_compress(&info_);
    return true;
  }
  std::vector<uint8_t> bytes() const { return {bytes_, bytes_ + size_}; }
  const char* problem() const { return errors_.problem; }

 private:
  EncodeErrors errors_ = {};
  jpeg_compress_struct info_ = {};
  unsigned char* bytes_ = nullptr;
  unsigned long size_ = 0;  // NOLINT(google-runtime-int): libjpeg's
};

}  // namespace

absl::StatusOr<std::vector<uint8_t>> EncodeJpeg(const ImagePixels& image, int quality) {
  WEFT_RETURN_IF_ERROR(CheckPixels(image, 3, 8));
  JpegWriter writer;
  if (!writer.Write(image, quality))
    return absl::InvalidArgumentError(
        absl::StrCat("the image cannot be encoded as JPEG: ", writer.problem()));
  return writer.bytes();
}

}  // namespace weft
