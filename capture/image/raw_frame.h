// Images as cameras deliver them, byte by byte: what a take stores. `Frame` (frame.h) is what the stages see.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/aligned_buffer.h"
#include "capture/image/frame.h"

namespace weft {

// The values are the codes of GenICam's Pixel Format Naming Convention (PFNC 2.4). Its bits 16 to 23 are
// the bits of a pixel. "p" packs pixels as a little-endian stream of bits, "Packed" (GigE Vision) two
// pixels into 3 bytes. "Csi2" (MIPI, V4L2) has the upper bytes of 4 pixels of 10 bits, or 2 of 12, before
// one byte with their lower bits. The convention has neither Csi2 nor motion JPEG, so their codes are
// ours.
enum class RawFormat : uint32_t {
  kMono8 = 0x01080001,
  kMono10 = 0x01100003,
  kMono10p = 0x010a0046,
  kMono10Packed = 0x010c0004,
  kMono12 = 0x01100005,
  kMono12p = 0x010c0047,
  kMono12Packed = 0x010c0006,
  kMono16 = 0x01100007,
  kBayerGr8 = 0x01080008,
  kBayerRg8 = 0x01080009,
  kBayerGb8 = 0x0108000a,
  kBayerBg8 = 0x0108000b,
  kBayerGr10 = 0x0110000c,
  kBayerRg10 = 0x0110000d,
  kBayerGb10 = 0x0110000e,
  kBayerBg10 = 0x0110000f,
  kBayerGr12 = 0x01100010,
  kBayerRg12 = 0x01100011,
  kBayerGb12 = 0x01100012,
  kBayerBg12 = 0x01100013,
  kBayerGr10p = 0x010a0056,
  kBayerRg10p = 0x010a0058,
  kBayerGb10p = 0x010a0054,
  kBayerBg10p = 0x010a0052,
  kBayerGr12p = 0x010c0057,
  kBayerRg12p = 0x010c0059,
  kBayerGb12p = 0x010c0055,
  kBayerBg12p = 0x010c0053,
  kBayerGr10Packed = 0x010c0026,
  kBayerRg10Packed = 0x010c0027,
  kBayerGb10Packed = 0x010c0028,
  kBayerBg10Packed = 0x010c0029,
  kBayerGr12Packed = 0x010c002a,
  kBayerRg12Packed = 0x010c002b,
  kBayerGb12Packed = 0x010c002c,
  kBayerBg12Packed = 0x010c002d,
  kRgb8 = 0x02180014,
  kBgr8 = 0x02180015,
  kYuyv = 0x02100032,
  kUyvy = 0x0210001f,
  kMotionJpeg = 0x80000001,
  kMono10Csi2 = 0x810a0046,
  kMono12Csi2 = 0x810c0047,
  kBayerGr10Csi2 = 0x810a0056,
  kBayerRg10Csi2 = 0x810a0058,
  kBayerGb10Csi2 = 0x810a0054,
  kBayerBg10Csi2 = 0x810a0052,
  kBayerGr12Csi2 = 0x810c0057,
  kBayerRg12Csi2 = 0x810c0059,
  kBayerGb12Csi2 = 0x810c0055,
  kBayerBg12Csi2 = 0x810c0053,
};

// The convention's name ("BayerRG8", "Mono12p", ...), empty for codes that are not in the list above; the
// inverse answers InvalidArgument with the list of names.
std::string_view RawFormatName(RawFormat format);
absl::StatusOr<RawFormat> RawFormatFromName(std::string_view name);
// True for the codes above.
bool IsRawFormat(uint32_t code);

// Bytes of an image, lines without padding; 0 for motion JPEG, whose images have any size.
uint64_t RawBytes(RawFormat format, int width_px, int height_px);

// One image of one camera. Copies share the bytes, which nobody changes any more.
struct RawFrame {
  std::string camera_id;
  int width_px = 0;
  int height_px = 0;
  RawFormat format = RawFormat::kMono8;
  std::shared_ptr<const AlignedBuffer> bytes;
  int64_t device_time_ns = 0;    // the camera's clock, at the start of the exposure where the camera says so
  int64_t host_time_ns = 0;      // CLOCK_REALTIME, when the last byte arrived
  uint64_t device_frame_id = 0;  // the camera's count of triggers, unwrapped

  // Sizes positive and at most 65536, format known, bytes complete.
  absl::Status Validate() const;
};

// The images of one trigger. Every camera of the session is either in `frames` or in `missing`.
struct RawFrameSet {
  uint64_t number = 0;         // of the set in its take
  int64_t device_time_ns = 0;  // of the trigger
  std::vector<RawFrame> frames;
  std::vector<MissingFrame> missing;

  uint64_t bytes() const;
};

// Which 8 bits of deeper pixels the stages get.
enum class DeepBits {
  kUpper,  // of the format: brightness tells the exposure, and is the same in all frames
  kUsed,   // from the highest that the frame uses (BitsInUse): dark frames keep their levels
};

// Eight bits for the stages; YUV and JPEG become RGB. InvalidArgument: an invalid frame, or a JPEG that
// cannot be decoded or has another size.
absl::StatusOr<Frame> ToFrame(const RawFrame& raw, DeepBits deep = DeepBits::kUpper);

// What a camera of 8 bits would deliver.
RawFormat RawFormatOf(PixelFormat format);
// The same image as such a camera would have delivered it.
absl::StatusOr<RawFrame> ToRawFrame(const Frame& frame);

}  // namespace weft
