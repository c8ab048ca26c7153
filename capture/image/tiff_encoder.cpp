#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "capture/image/tiff_file.h"

namespace weft {
namespace {

void SetFields(TIFF* tiff, const ImagePixels& image, double dpi) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<uint32_t>(image.width_px));
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<uint32_t>(image.height_px));
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, image.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, image.channels);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, image.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff, 0));
  if (dpi <= 0) return;
  TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH);
  TIFFSetField(tiff, TIFFTAG_XRESOLUTION, dpi);
  TIFFSetField(tiff, TIFFTAG_YRESOLUTION, dpi);
}

bool WriteRows(TIFF* tiff, const ImagePixels& image) {
  const size_t row_bytes = image.bytes.size() / static_cast<size_t>(image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    // libtiff may predict in place.
    std::vector<uint8_t> row(image.bytes.begin() + static_cast<std::ptrdiff_t>(row_bytes * y),
                             image.bytes.begin() + static_cast<std::ptrdiff_t>(row_bytes * (y + 1)));
    if (TIFFWriteScanline(tiff, row.data(), static_cast<uint32_t>(y), 0) < 0) return false;
  }
  return TIFFFlush(tiff) == 1;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> EncodeTiff(const ImagePixels& image, double dpi) {
  WEFT_RETURN_IF_ERROR(CheckPixels(image, 3, 16));
  TiffMemory memory;
  memory.writes = true;
  {
    const TiffHandle tiff = OpenTiff(memory);
    if (tiff) SetFields(tiff.get(), image, dpi);
    if (!tiff || !WriteRows(tiff.get(), image))
      return absl::InternalError(absl::StrCat("the image cannot be encoded as TIFF: ", memory.problem));
  }
  return std::move(memory.written);
}

}  // namespace weft
