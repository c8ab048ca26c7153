// Images as cameras deliver them, and the images of one trigger.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

enum class PixelFormat { kGrey8, kRgb8, kBayerRg8, kBayerGr8, kBayerGb8, kBayerBg8 };

// Bytes of one pixel: 3 for kRgb8, 1 otherwise.
int BytesPerPixel(PixelFormat format);
// "grey8", "rgb8", "bayer_rg8" ...; the inverse answers InvalidArgument with the list of names.
std::string_view PixelFormatName(PixelFormat format);
absl::StatusOr<PixelFormat> PixelFormatFromName(std::string_view name);

// One image. Rows follow each other without padding: byte (y * width_px + x) * BytesPerPixel + channel.
// A Bayer name tells the colours of the first two pixels of the first row. Copies share the pixels.
struct Frame {
  std::string camera_id;
  int width_px = 0;
  int height_px = 0;
  PixelFormat format = PixelFormat::kGrey8;
  std::shared_ptr<const std::vector<uint8_t>> pixels;
  int64_t device_time_ns = 0;  // 0 where the source has no device clock
  std::string origin;          // file or device, for messages

  const uint8_t* row(int y) const {
    return pixels->data() + static_cast<size_t>(y) * width_px * BytesPerPixel(format);
  }
  // Size positive and pixels complete.
  absl::Status Validate() const;
};

// A camera that a frame set lacks, with the reason in words.
struct MissingFrame {
  std::string camera_id;
  std::string reason;
};

// The images of one trigger, ordered as the rig's cameras.
struct FrameSet {
  std::string name;  // "0000", the folder or the number of the frame
  std::vector<Frame> frames;
  std::vector<MissingFrame> missing;
};

// Red, green and blue, [height][width][3] bytes; Bayer frames are demosaiced (bilinear), grey is repeated.
absl::StatusOr<Frame> ToRgb(const Frame& frame);

}  // namespace weft
