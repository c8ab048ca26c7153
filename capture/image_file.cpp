#include "capture/image_file.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/image_decoders.h"
#include "capture/image_header.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxFileBytes = uint64_t{4} << 30;

std::string Size(const ImageSize& size) { return absl::StrCat(size.width_px, "x", size.height_px); }

// The most that a file of such an image may take: 16 bits of 4 channels, and room for what else stands in it.
uint64_t MostBytes(const std::optional<ImageSize>& expected) {
  if (!expected) return kMaxFileBytes;
  return 8 * static_cast<uint64_t>(expected->width_px) * expected->height_px + (uint64_t{64} << 20);
}

absl::StatusOr<std::vector<uint8_t>> ReadBytes(const std::string& path, uint64_t most_bytes) {
  std::error_code error;
  if (!fs::exists(path, error)) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  if (!fs::is_regular_file(path, error))
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a file"));
  const uint64_t size = fs::file_size(path, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (size > most_bytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": ", size >> 20, " MiB, an image here takes no more than ", most_bytes >> 20));
  }
  std::vector<uint8_t> bytes(size);
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)) && size > 0) {
    return absl::UnavailableError(absl::StrCat(path, ": cannot be read (permissions?)"));
  }
  return bytes;
}

// Before pixels are decoded: a small file may announce an image that fills the memory.
absl::Status CheckSize(const ImageHeader& header, const std::optional<ImageSize>& expected) {
  const ImageSize size = {header.width_px, header.height_px};
  if (expected && (size.width_px != expected->width_px || size.height_px != expected->height_px)) {
    return absl::InvalidArgumentError(
        absl::StrCat("image is ", Size(size), ", the rig says ", Size(*expected)));
  }
  if (int64_t{size.width_px} * size.height_px <= kMaxImagePixels) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("image is ", Size(size), ", more than the ",
                                                 kMaxImagePixels >> 20, " Mi pixels that are read"));
}

absl::StatusOr<DecodedImage> DecodeTiff(const std::vector<uint8_t>& bytes) {
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("cannot be decoded (", e.err, ")"));
  }
  if (image.empty())
    return absl::InvalidArgumentError("the TIFF image is damaged or truncated; copy the file again");
  if (image.depth() == CV_16U) {
    image.convertTo(image, CV_8U, 1.0 / 257.0);
  } else if (image.depth() != CV_8U) {
    return absl::InvalidArgumentError("only 8 and 16 bit images are supported");
  }
  if (image.channels() == 3) {
    cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  } else if (image.channels() == 4) {
    cv::cvtColor(image, image, cv::COLOR_BGRA2RGB);
  } else if (image.channels() != 1) {
    return absl::InvalidArgumentError(absl::StrCat(image.channels(), " channels, expected 1, 3 or 4"));
  }
  if (!image.isContinuous()) image = image.clone();
  return DecodedImage{image.cols, image.rows, image.channels(), {image.datastart, image.dataend}};
}

absl::StatusOr<DecodedImage> Decode(const std::vector<uint8_t>& bytes,
                                    const std::optional<ImageSize>& expected) {
  if (bytes.empty()) return absl::InvalidArgumentError("the file is empty");
  const absl::StatusOr<ImageHeader> header = ReadImageHeader(bytes);
  if (!header.ok()) return header.status();
  if (absl::Status status = CheckSize(*header, expected); !status.ok()) return status;
  switch (header->format) {
    case ImageFormat::kPng:
      return DecodePng(bytes);
    case ImageFormat::kJpeg:
      return DecodeJpeg(bytes);
    case ImageFormat::kTiff:
      return DecodeTiff(bytes);
  }
  return absl::InternalError("unknown format");
}

// The file appears under its name only when it is complete.
absl::Status EncodeAndWrite(const std::string& path, const cv::Mat& image,
                            const std::vector<int>& parameters) {
  std::vector<uint8_t> bytes;
  try {
    if (!cv::imencode(fs::path(path).extension().string(), image, bytes, parameters)) {
      return absl::InternalError(absl::StrCat(path, ": the image cannot be encoded"));
    }
  } catch (const cv::Exception& e) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": unknown image format; end the name in .png, .jpg or .tif"));
  }
  const std::string temporary = absl::StrCat(path, ".tmp.", getpid());
  std::ofstream out(temporary, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  std::error_code error;
  if (out) fs::rename(temporary, path, error);
  if (!out || error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    return absl::UnavailableError(
        absl::StrCat(path, ": cannot be written (folder missing, read-only or disk full?)"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Frame> ReadImageFile(const std::string& path, std::optional<PixelFormat> mosaic,
                                    std::optional<ImageSize> expected) {
  const absl::StatusOr<std::vector<uint8_t>> bytes = ReadBytes(path, MostBytes(expected));
  if (!bytes.ok()) return bytes.status();
  absl::StatusOr<DecodedImage> image = Decode(*bytes, expected);
  if (!image.ok())
    return absl::Status(image.status().code(), absl::StrCat(path, ": ", image.status().message()));
  Frame frame;
  frame.origin = path;
  frame.width_px = image->width_px;
  frame.height_px = image->height_px;
  frame.format = image->channels == 3 ? PixelFormat::kRgb8 : mosaic.value_or(PixelFormat::kGrey8);
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(image->values));
  return frame;
}

absl::Status WriteImageFile(const std::string& path, const Frame& frame, int jpeg_quality) {
  if (absl::Status status = frame.Validate(); !status.ok()) return status;
  const bool rgb = frame.format == PixelFormat::kRgb8;
  cv::Mat image(frame.height_px, frame.width_px, rgb ? CV_8UC3 : CV_8UC1,
                const_cast<uint8_t*>(frame.pixels->data()));
  if (rgb) {
    cv::Mat bgr;
    cv::cvtColor(image, bgr, cv::COLOR_RGB2BGR);
    image = bgr;
  }
  return EncodeAndWrite(path, image, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
}

absl::Status WriteDeepImageFile(const std::string& path, const DeepImage& image) {
  const std::string ending = fs::path(path).extension().string();
  if (ending != ".png" && ending != ".tif" && ending != ".tiff") {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": 16-bit images are PNG or TIFF; end the name in .png or .tif"));
  }
  if (image.width_px <= 0 || image.height_px <= 0 || (image.channels != 1 && image.channels != 3) ||
      image.values.size() != static_cast<size_t>(image.width_px) * image.height_px * image.channels) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", image.values.size(), " values for ",
                                                   image.width_px, " x ", image.height_px, " pixels of ",
                                                   image.channels, " channels"));
  }
  cv::Mat pixels(image.height_px, image.width_px, image.channels == 3 ? CV_16UC3 : CV_16UC1,
                 const_cast<uint16_t*>(image.values.data()));
  cv::Mat bgr;
  if (image.channels == 3) cv::cvtColor(pixels, bgr, cv::COLOR_RGB2BGR);
  return EncodeAndWrite(path, image.channels == 3 ? bgr : pixels, {});
}

}  // namespace weft
