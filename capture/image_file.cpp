#include "capture/image_file.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxFileBytes = uint64_t{4} << 30;

absl::StatusOr<std::vector<uint8_t>> ReadBytes(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  if (!fs::is_regular_file(path, error))
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a file"));
  const uint64_t size = fs::file_size(path, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (size > kMaxFileBytes) return absl::InvalidArgumentError(absl::StrCat(path, ": larger than 4 GiB"));
  std::vector<uint8_t> bytes(size);
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)) && size > 0) {
    return absl::UnavailableError(absl::StrCat(path, ": cannot be read (permissions?)"));
  }
  return bytes;
}

// Decoders fill what a truncated file lacks with grey and carry on; the end marker tells.
bool HasEndMarker(const std::vector<uint8_t>& bytes) {
  const auto tail_has = [&](std::initializer_list<uint8_t> marker, size_t tail) {
    const size_t from = bytes.size() > tail ? bytes.size() - tail : 0;
    return std::search(bytes.begin() + static_cast<std::ptrdiff_t>(from), bytes.end(), marker.begin(),
                       marker.end()) != bytes.end();
  };
  if (bytes.size() >= 2 && bytes[0] == 0xff && bytes[1] == 0xd8) return tail_has({0xff, 0xd9}, 4096);
  if (bytes.size() >= 4 && bytes[0] == 0x89 && bytes[1] == 'P') return tail_has({'I', 'E', 'N', 'D'}, 4096);
  return true;
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

absl::StatusOr<Frame> ReadImageFile(const std::string& path, std::optional<PixelFormat> mosaic) {
  const absl::StatusOr<std::vector<uint8_t>> bytes = ReadBytes(path);
  if (!bytes.ok()) return bytes.status();
  if (bytes->empty()) return absl::InvalidArgumentError(absl::StrCat(path, ": the file is empty"));
  if (!HasEndMarker(*bytes)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": the image is truncated; copy the file again"));
  }
  cv::Mat image;
  try {
    image = cv::imdecode(*bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": cannot be decoded (", e.err, ")"));
  }
  if (image.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": not a readable PNG, JPEG or TIFF image (truncated or another format?)"));
  }
  if (image.depth() == CV_16U) {
    image.convertTo(image, CV_8U, 1.0 / 257.0);
  } else if (image.depth() != CV_8U) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": only 8 and 16 bit images are supported"));
  }
  Frame frame;
  frame.origin = path;
  frame.width_px = image.cols;
  frame.height_px = image.rows;
  switch (image.channels()) {
    case 1:
      frame.format = mosaic.value_or(PixelFormat::kGrey8);
      break;
    case 3:
      cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
      frame.format = PixelFormat::kRgb8;
      break;
    case 4:
      cv::cvtColor(image, image, cv::COLOR_BGRA2RGB);
      frame.format = PixelFormat::kRgb8;
      break;
    default:
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": ", image.channels(), " channels, expected 1, 3 or 4"));
  }
  if (!image.isContinuous()) image = image.clone();
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(image.datastart, image.dataend);
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
