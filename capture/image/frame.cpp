#include "capture/image/frame.h"

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr std::array<std::pair<PixelFormat, std::string_view>, 6> kNames = {{
    {PixelFormat::kGrey8, "grey8"},
    {PixelFormat::kRgb8, "rgb8"},
    {PixelFormat::kBayerRg8, "bayer_rg8"},
    {PixelFormat::kBayerGr8, "bayer_gr8"},
    {PixelFormat::kBayerGb8, "bayer_gb8"},
    {PixelFormat::kBayerBg8, "bayer_bg8"},
}};

// OpenCV names a mosaic by the second row's second and third pixel.
int OpenCvToRgbCode(PixelFormat format) {
  switch (format) {
    case PixelFormat::kBayerRg8:
      return cv::COLOR_BayerBG2RGB;
    case PixelFormat::kBayerGr8:
      return cv::COLOR_BayerGB2RGB;
    case PixelFormat::kBayerGb8:
      return cv::COLOR_BayerGR2RGB;
    case PixelFormat::kBayerBg8:
      return cv::COLOR_BayerRG2RGB;
    default:
      return cv::COLOR_GRAY2RGB;
  }
}

}  // namespace

int BytesPerPixel(PixelFormat format) { return format == PixelFormat::kRgb8 ? 3 : 1; }

std::string_view PixelFormatName(PixelFormat format) {
  for (const auto& [value, name] : kNames) {
    if (value == format) return name;
  }
  return "unknown";
}

absl::StatusOr<PixelFormat> PixelFormatFromName(std::string_view name) {
  std::string known;
  for (const auto& [value, text] : kNames) {
    if (text == name) return value;
    absl::StrAppend(&known, known.empty() ? "" : ", ", std::string(text));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("pixel format \"", std::string(name), "\" is unknown; expected one of ", known));
}

absl::Status Frame::Validate() const {
  const std::string who =
      absl::StrCat(origin.empty() ? "frame" : origin, camera_id.empty() ? "" : ", camera ", camera_id);
  if (width_px <= 0 || height_px <= 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(who, ": size ", width_px, "x", height_px, " is not positive"));
  }
  const size_t expected = static_cast<size_t>(width_px) * height_px * BytesPerPixel(format);
  const size_t have = pixels ? pixels->size() : 0;
  if (have != expected) {
    return absl::InvalidArgumentError(absl::StrCat(who, ": ", have, " bytes of pixels, expected ", expected,
                                                   " for ", width_px, "x", height_px));
  }
  return absl::OkStatus();
}

absl::StatusOr<Frame> ToRgb(const Frame& frame) {
  WEFT_RETURN_IF_ERROR(frame.Validate());
  if (frame.format == PixelFormat::kRgb8) return frame;
  const bool mosaic = frame.format != PixelFormat::kGrey8;
  if (mosaic && (frame.width_px < 3 || frame.height_px < 3)) {
    return absl::InvalidArgumentError(
        absl::StrCat(frame.origin, ": a Bayer mosaic needs at least 3x3 pixels"));
  }
  auto pixels =
      std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(frame.width_px) * frame.height_px * 3);
  const cv::Mat in(frame.height_px, frame.width_px, CV_8UC1, const_cast<uint8_t*>(frame.pixels->data()));
  cv::Mat out(frame.height_px, frame.width_px, CV_8UC3, pixels->data());
  cv::cvtColor(in, out, OpenCvToRgbCode(frame.format));
  Frame rgb = frame;
  rgb.format = PixelFormat::kRgb8;
  rgb.pixels = std::move(pixels);
  return rgb;
}

}  // namespace weft
