#include "capture/image/image_file.h"

#include <fcntl.h>

#include <cerrno>
#include <filesystem>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "base/whole_file.h"
#include "capture/file/posix_file.h"
#include "capture/image/image_decoders.h"
#include "capture/image/image_encoders.h"
#include "capture/image/image_header.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxFileBytes = uint64_t{4} << 30;

// The most that a file of such an image may take: 16 bits of 4 channels, and room for what else stands in it.
uint64_t MostBytes(const std::optional<ImageSize>& expected) {
  if (!expected) return kMaxFileBytes;
  return 8 * static_cast<uint64_t>(expected->width_px) * expected->height_px + (uint64_t{64} << 20);
}

absl::StatusOr<std::vector<uint8_t>> ReadBytes(const std::string& path, uint64_t most_bytes) {
  std::error_code error;
  if (!fs::exists(path, error)) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  WEFT_ASSIGN_OR_RETURN(const PosixFile file, PosixFile::Open(path, O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(const uint64_t size, file.Size());
  if (size > most_bytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": ", size >> 20, " MiB, an image here takes no more than ", most_bytes >> 20));
  }
  std::vector<uint8_t> bytes(size);
  WEFT_RETURN_IF_ERROR(file.ReadAt(bytes.data(), bytes.size(), 0));
  return bytes;
}

// Before pixels are decoded: a small file may announce an image that fills the memory.
absl::Status CheckSize(const ImageHeader& header, const std::optional<ImageSize>& expected) {
  const ImageSize size = {header.width_px, header.height_px};
  if (expected && size != *expected) return WrongSizeError("", {size, *expected});
  if (int64_t{size.width_px} * size.height_px <= kMaxImagePixels) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("image is ", SizeText(size), ", more than the ",
                                                 kMaxImagePixels >> 20, " Mi pixels that are read"));
}

absl::StatusOr<DecodedImage> Decode(const std::vector<uint8_t>& bytes,
                                    const std::optional<ImageSize>& expected) {
  if (bytes.empty()) return absl::InvalidArgumentError("the file is empty");
  WEFT_ASSIGN_OR_RETURN(const ImageHeader header, ReadImageHeader(bytes));
  WEFT_RETURN_IF_ERROR(CheckSize(header, expected));
  switch (header.format) {
    case ImageFormat::kPng:
      return DecodePng(bytes);
    case ImageFormat::kJpeg:
      return DecodeJpeg(bytes);
    case ImageFormat::kTiff:
      return DecodeTiff(bytes, int64_t{header.width_px} * header.height_px);
  }
  return absl::InternalError("unknown format");
}

// Of files that say themselves that they hold a mosaic.
absl::Status CheckMosaic(const DecodedImage& image, const std::optional<PixelFormat>& named) {
  if (!image.is_mosaic || (named && !image.mosaic)) return absl::OkStatus();
  if (!image.mosaic) {
    return absl::InvalidArgumentError(
        "a Bayer mosaic that does not say the order of its colours; name it with --mosaic");
  }
  if (!named || *named == *image.mosaic) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("the file says that it is ", std::string(PixelFormatName(*image.mosaic)),
                   ", --mosaic says ", std::string(PixelFormatName(*named)), "; leave the option out"));
}

absl::StatusOr<std::vector<uint8_t>> Encode(const std::string& path, const ImagePixels& image,
                                            int jpeg_quality) {
  const std::string ending = absl::AsciiStrToLower(fs::path(path).extension().string());
  if (ending == ".png") return EncodePng(image);
  if (ending == ".tif" || ending == ".tiff") return EncodeTiff(image);
  if (ending == ".jpg" || ending == ".jpeg") return EncodeJpeg(image, jpeg_quality);
  return absl::InvalidArgumentError("unknown image format; end the name in .png, .jpg or .tif");
}

// The file appears under its name only when it is complete.
absl::Status EncodeAndWrite(const std::string& path, const ImagePixels& image, int jpeg_quality) {
  const absl::StatusOr<std::vector<uint8_t>> encoded = Encode(path, image, jpeg_quality);
  if (!encoded.ok()) return StatusAt(path, encoded.status());
  const std::string_view bytes(reinterpret_cast<const char*>(encoded->data()), encoded->size());
  const int error = ReplaceWholeFile(path, bytes, 0666, Flush::kLater);
  return error == 0 ? absl::OkStatus() : FileError(path, "cannot be written", error);
}

}  // namespace

absl::StatusOr<Frame> ReadImageFile(const std::string& path, std::optional<PixelFormat> mosaic,
                                    std::optional<ImageSize> expected) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(path, MostBytes(expected)));
  absl::StatusOr<DecodedImage> image = Decode(bytes, expected);
  if (!image.ok()) return StatusAt(path, image.status());
  if (absl::Status status = CheckMosaic(*image, mosaic); !status.ok()) return StatusAt(path, status);
  Frame frame;
  frame.origin = path;
  frame.width_px = image->width_px;
  frame.height_px = image->height_px;
  const PixelFormat grey = mosaic ? *mosaic : image->mosaic.value_or(PixelFormat::kGrey8);
  frame.format = image->channels == 3 ? PixelFormat::kRgb8 : grey;
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(image->values));
  return frame;
}

absl::Status WriteImageFile(const std::string& path, const Frame& frame, int jpeg_quality) {
  WEFT_RETURN_IF_ERROR(frame.Validate());
  const int channels = frame.format == PixelFormat::kRgb8 ? 3 : 1;
  return EncodeAndWrite(path, {frame.width_px, frame.height_px, channels, 8, *frame.pixels}, jpeg_quality);
}

absl::Status WriteDeepImageFile(const std::string& path, const DeepImage& image) {
  const std::string ending = fs::path(path).extension().string();
  if (ending != ".png" && ending != ".tif" && ending != ".tiff") {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": 16-bit images are PNG or TIFF; end the name in .png or .tif"));
  }
  const ImagePixels pixels = {
      image.width_px,
      image.height_px,
      image.channels,
      16,
      {reinterpret_cast<const uint8_t*>(image.values.data()), image.values.size() * sizeof(uint16_t)}};
  return EncodeAndWrite(path, pixels, 0);
}

}  // namespace weft
