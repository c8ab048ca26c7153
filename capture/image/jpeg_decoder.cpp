#include <csetjmp>
#include <cstdio>
#include <cstring>

#include <jerror.h>
#include <jpeglib.h>

#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "capture/image/exif_orientation.h"
#include "capture/image/image_decoders.h"

namespace weft {
namespace {

// More scans than any camera or program writes: each costs the time of a whole image.
constexpr int kMaxScans = 200;
constexpr unsigned kMostSegmentBytes = 0xffff;

// libjpeg's error manager: errors jump back, the first warning is kept.
struct DecodeErrors {
  jpeg_error_mgr manager;  // first, libjpeg knows the others by it
  std::jmp_buf jump;
  char problem[JMSG_LENGTH_MAX];
  int error;  // libjpeg's code of what ended it, else 0
  bool damaged;
  bool in_pixels;  // what precedes them is read
  JpegOrigin origin;
};

DecodeErrors& ErrorsOf(j_common_ptr info) { return *reinterpret_cast<DecodeErrors*>(info->err); }

void Keep(j_common_ptr info) {
  DecodeErrors& errors = ErrorsOf(info);
  if (!errors.damaged) info->err->format_message(info, errors.problem);
  errors.damaged = true;
}

extern "C" void WeftJpegError(j_common_ptr info) {
  Keep(info);
  ErrorsOf(info).error = info->err->msg_code;
  std::longjmp(ErrorsOf(info).jump, 1);
}

// Of metadata alone: bytes between segments, as after lengths that are too short, and odd versions.
bool IsHarmless(int warning, const DecodeErrors& errors) {
  if (warning == JWRN_EXTRANEOUS_DATA) return !errors.in_pixels || errors.origin == JpegOrigin::kCamera;
  return warning == JWRN_JFIF_MAJOR || warning == JWRN_ADOBE_XFORM;
}

// Levels below 0 are warnings of damaged data, others are trace.
extern "C" void WeftJpegMessage(j_common_ptr info, int level) {
  if (level < 0 && !IsHarmless(info->err->msg_code, ErrorsOf(info))) Keep(info);
}

extern "C" void WeftJpegProgress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= kMaxScans) return;
  DecodeErrors& errors = ErrorsOf(info);
  std::snprintf(errors.problem, sizeof(errors.problem), "more than %d scans", kMaxScans);
  errors.damaged = true;
  std::longjmp(errors.jump, 1);
}

// One file. No function that longjmp may leave owns anything but this.
class JpegFile {
 public:
  JpegFile(std::span<const uint8_t> bytes, JpegOrigin origin) : bytes_(bytes) {
    info_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = WeftJpegError;
    errors_.manager.emit_message = WeftJpegMessage;
    errors_.problem[0] = '\0';
    errors_.error = 0;
    errors_.damaged = false;
    errors_.in_pixels = false;
    errors_.origin = origin;
    progress_.progress_monitor = WeftJpegProgress;
  }
  ~JpegFile() { jpeg_destroy_decompress(&info_); }
  JpegFile(const JpegFile&) = delete;
  JpegFile& operator=(const JpegFile&) = delete;

  // False: see problem().
  bool ReadHeader() {
    if (setjmp(errors_.jump) != 0) return false;
    jpeg_create_decompress(&info_);
    info_.progress = &progress_;
    jpeg_mem_src(&info_, bytes_.data(), bytes_.size());
    jpeg_save_markers(&info_, JPEG_APP0 + 1, kMostSegmentBytes);
    jpeg_read_header(&info_, TRUE);
    info_.out_color_space = info_.num_components == 1   ? JCS_GRAYSCALE
                            : info_.num_components == 4 ? JCS_CMYK
                                                        : JCS_RGB;
    jpeg_calc_output_dimensions(&info_);
    errors_.in_pixels = true;
    return true;
  }
  // `values`: room for all rows of output_components() values.
  bool ReadPixels(uint8_t* values) {
    if (setjmp(errors_.jump) != 0) return false;
    jpeg_start_decompress(&info_);
    const size_t row_bytes = static_cast<size_t>(info_.output_width) * info_.output_components;
    while (info_.output_scanline < info_.output_height) {
      uint8_t* row = values + info_.output_scanline * row_bytes;
      jpeg_read_scanlines(&info_, &row, 1);
    }
    jpeg_finish_decompress(&info_);
    return !errors_.damaged;
  }

  int width_px() const { return static_cast<int>(info_.output_width); }
  int height_px() const { return static_cast<int>(info_.output_height); }
  int output_components() const { return info_.output_components; }
  bool damaged() const { return errors_.damaged; }
  int orientation() const {
    constexpr std::string_view kExif("Exif\0\0", 6);
    for (const jpeg_marker_struct* marker = info_.marker_list; marker != nullptr; marker = marker->next) {
      const std::span<const uint8_t> data(marker->data, marker->data_length);
      if (data.size() < kExif.size() || std::memcmp(data.data(), kExif.data(), kExif.size()) != 0) continue;
      return OrientationInExif(data.subspan(kExif.size()));
    }
    return 1;
  }
  const char* problem() const { return errors_.problem; }
  int error() const { return errors_.error; }

 private:
  std::span<const uint8_t> bytes_;
  DecodeErrors errors_ = {};
  jpeg_progress_mgr progress_ = {};
  jpeg_decompress_struct info_ = {};
};

// Inverted inks, as programs of the press write them.
std::vector<uint8_t> RgbFromCmyk(const std::vector<uint8_t>& cmyk) {
  std::vector<uint8_t> rgb(cmyk.size() / 4 * 3);
  for (size_t i = 0; i < cmyk.size() / 4; ++i) {
    const int black = cmyk[4 * i + 3];
    for (size_t c = 0; c < 3; ++c)
      rgb[3 * i + c] = static_cast<uint8_t>(black - ((255 - cmyk[4 * i + c]) * black >> 8));
  }
  return rgb;
}

// Sound files of processes that libjpeg lacks: lossless, hierarchical, 12 bits.
bool IsOfAnotherKind(int error) {
  return error == JERR_SOF_UNSUPPORTED || error == JERR_BAD_PRECISION || error == JERR_CONVERSION_NOTIMPL ||
         error == JERR_ARITH_NOTIMPL || error == JERR_NOT_COMPILED || error == JERR_CCIR601_NOTIMPL ||
         error == JERR_FRACT_SAMPLE_NOTIMPL;
}

absl::Status WhyNoPixels(const JpegFile& file) {
  if (IsOfAnotherKind(file.error())) {
    return absl::InvalidArgumentError(
        absl::StrCat("a JPEG image of a kind that is not read (", file.problem(), "); convert it"));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("the JPEG image is damaged or truncated (", file.problem(), "); copy the file again"));
}

}  // namespace

absl::StatusOr<ImageHeader> ReadJpegHeader(std::span<const uint8_t> bytes) {
  JpegFile file(bytes, JpegOrigin::kFile);
  if (!file.ReadHeader() || file.damaged()) return WhyNoPixels(file);
  return ImageHeader{ImageFormat::kJpeg, file.width_px(), file.height_px(), file.orientation()};
}

absl::StatusOr<DecodedImage> DecodeJpeg(std::span<const uint8_t> bytes, JpegOrigin origin) {
  JpegFile file(bytes, origin);
  if (!file.ReadHeader()) return WhyNoPixels(file);
  DecodedImage image{file.width_px(), file.height_px(), file.output_components(), {}};
  if (image.channels != 1 && image.channels != 3 && image.channels != 4)
    return absl::InvalidArgumentError(absl::StrCat(image.channels, " channels, expected 1 or 3"));
  image.values.resize(static_cast<size_t>(image.width_px) * image.height_px * image.channels);
  if (!file.ReadPixels(image.values.data())) return WhyNoPixels(file);
  if (image.channels == 4) {
    image.values = RgbFromCmyk(image.values);
    image.channels = 3;
  }
  return image;
}

}  // namespace weft
