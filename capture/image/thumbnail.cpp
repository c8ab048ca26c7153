#include "capture/image/thumbnail.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "absl/strings/str_cat.h"

namespace weft {

absl::StatusOr<Frame> Resized(const Frame& frame, int width_px, int height_px) {
  if (width_px <= 0 || height_px <= 0)
    return absl::InvalidArgumentError(absl::StrCat("a picture of ", width_px, "x", height_px, " px"));
  absl::StatusOr<Frame> rgb = ToRgb(frame);
  if (!rgb.ok()) return rgb;
  const cv::Mat large(rgb->height_px, rgb->width_px, CV_8UC3, const_cast<uint8_t*>(rgb->pixels->data()));
  cv::Mat small;
  cv::resize(large, small, {width_px, height_px}, 0, 0, cv::INTER_AREA);
  rgb->pixels = std::make_shared<const std::vector<uint8_t>>(small.datastart, small.dataend);
  rgb->width_px = width_px;
  rgb->height_px = height_px;
  return rgb;
}

absl::StatusOr<Frame> Thumbnail(const Frame& frame, int width_px) {
  if (frame.width_px <= width_px) return ToRgb(frame);
  return Resized(frame, width_px,
                 std::max(1, static_cast<int>(int64_t{frame.height_px} * width_px / frame.width_px)));
}

}  // namespace weft
