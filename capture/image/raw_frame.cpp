#include "capture/image/raw_frame.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/grey_levels.h"
#include "capture/image/image_decoders.h"
#include "capture/image/image_header.h"

namespace weft {
namespace {

constexpr int kMaxSide_px = 65536;

// How pixels lie in the bytes.
enum class Layout { kBytes, kWords, kBitStream, kPairsIn3Bytes, kCsi2, kBgr, kYuyv, kUyvy, kJpeg };

struct FormatInfo {
  RawFormat format;
  std::string_view name;
  PixelFormat pixels;  // of the frame with 8 bits
  Layout layout;
  int bits;  // of a sample
};

constexpr std::array kFormats = {
    FormatInfo{RawFormat::kMono8, "Mono8", PixelFormat::kGrey8, Layout::kBytes, 8},
    FormatInfo{RawFormat::kMono10, "Mono10", PixelFormat::kGrey8, Layout::kWords, 10},
    FormatInfo{RawFormat::kMono10p, "Mono10p", PixelFormat::kGrey8, Layout::kBitStream, 10},
    FormatInfo{RawFormat::kMono10Packed, "Mono10Packed", PixelFormat::kGrey8, Layout::kPairsIn3Bytes, 10},
    FormatInfo{RawFormat::kMono12, "Mono12", PixelFormat::kGrey8, Layout::kWords, 12},
    FormatInfo{RawFormat::kMono12p, "Mono12p", PixelFormat::kGrey8, Layout::kBitStream, 12},
    FormatInfo{RawFormat::kMono12Packed, "Mono12Packed", PixelFormat::kGrey8, Layout::kPairsIn3Bytes, 12},
    FormatInfo{RawFormat::kMono16, "Mono16", PixelFormat::kGrey8, Layout::kWords, 16},
    FormatInfo{RawFormat::kBayerGr8, "BayerGR8", PixelFormat::kBayerGr8, Layout::kBytes, 8},
    FormatInfo{RawFormat::kBayerRg8, "BayerRG8", PixelFormat::kBayerRg8, Layout::kBytes, 8},
    FormatInfo{RawFormat::kBayerGb8, "BayerGB8", PixelFormat::kBayerGb8, Layout::kBytes, 8},
    FormatInfo{RawFormat::kBayerBg8, "BayerBG8", PixelFormat::kBayerBg8, Layout::kBytes, 8},
    FormatInfo{RawFormat::kBayerGr10, "BayerGR10", PixelFormat::kBayerGr8, Layout::kWords, 10},
    FormatInfo{RawFormat::kBayerRg10, "BayerRG10", PixelFormat::kBayerRg8, Layout::kWords, 10},
    FormatInfo{RawFormat::kBayerGb10, "BayerGB10", PixelFormat::kBayerGb8, Layout::kWords, 10},
    FormatInfo{RawFormat::kBayerBg10, "BayerBG10", PixelFormat::kBayerBg8, Layout::kWords, 10},
    FormatInfo{RawFormat::kBayerGr12, "BayerGR12", PixelFormat::kBayerGr8, Layout::kWords, 12},
    FormatInfo{RawFormat::kBayerRg12, "BayerRG12", PixelFormat::kBayerRg8, Layout::kWords, 12},
    FormatInfo{RawFormat::kBayerGb12, "BayerGB12", PixelFormat::kBayerGb8, Layout::kWords, 12},
    FormatInfo{RawFormat::kBayerBg12, "BayerBG12", PixelFormat::kBayerBg8, Layout::kWords, 12},
    FormatInfo{RawFormat::kBayerGr10p, "BayerGR10p", PixelFormat::kBayerGr8, Layout::kBitStream, 10},
    FormatInfo{RawFormat::kBayerRg10p, "BayerRG10p", PixelFormat::kBayerRg8, Layout::kBitStream, 10},
    FormatInfo{RawFormat::kBayerGb10p, "BayerGB10p", PixelFormat::kBayerGb8, Layout::kBitStream, 10},
    FormatInfo{RawFormat::kBayerBg10p, "BayerBG10p", PixelFormat::kBayerBg8, Layout::kBitStream, 10},
    FormatInfo{RawFormat::kBayerGr12p, "BayerGR12p", PixelFormat::kBayerGr8, Layout::kBitStream, 12},
    FormatInfo{RawFormat::kBayerRg12p, "BayerRG12p", PixelFormat::kBayerRg8, Layout::kBitStream, 12},
    FormatInfo{RawFormat::kBayerGb12p, "BayerGB12p", PixelFormat::kBayerGb8, Layout::kBitStream, 12},
    FormatInfo{RawFormat::kBayerBg12p, "BayerBG12p", PixelFormat::kBayerBg8, Layout::kBitStream, 12},
    FormatInfo{RawFormat::kBayerGr10Packed, "BayerGR10Packed", PixelFormat::kBayerGr8, Layout::kPairsIn3Bytes,
               10},
    FormatInfo{RawFormat::kBayerRg10Packed, "BayerRG10Packed", PixelFormat::kBayerRg8, Layout::kPairsIn3Bytes,
               10},
    FormatInfo{RawFormat::kBayerGb10Packed, "BayerGB10Packed", PixelFormat::kBayerGb8, Layout::kPairsIn3Bytes,
               10},
    FormatInfo{RawFormat::kBayerBg10Packed, "BayerBG10Packed", PixelFormat::kBayerBg8, Layout::kPairsIn3Bytes,
               10},
    FormatInfo{RawFormat::kBayerGr12Packed, "BayerGR12Packed", PixelFormat::kBayerGr8, Layout::kPairsIn3Bytes,
               12},
    FormatInfo{RawFormat::kBayerRg12Packed, "BayerRG12Packed", PixelFormat::kBayerRg8, Layout::kPairsIn3Bytes,
               12},
    FormatInfo{RawFormat::kBayerGb12Packed, "BayerGB12Packed", PixelFormat::kBayerGb8, Layout::kPairsIn3Bytes,
               12},
    FormatInfo{RawFormat::kBayerBg12Packed, "BayerBG12Packed", PixelFormat::kBayerBg8, Layout::kPairsIn3Bytes,
               12},
    FormatInfo{RawFormat::kRgb8, "RGB8", PixelFormat::kRgb8, Layout::kBytes, 8},
    FormatInfo{RawFormat::kBgr8, "BGR8", PixelFormat::kRgb8, Layout::kBgr, 8},
    FormatInfo{RawFormat::kYuyv, "YUV422_8", PixelFormat::kRgb8, Layout::kYuyv, 8},
    FormatInfo{RawFormat::kUyvy, "YUV422_8_UYVY", PixelFormat::kRgb8, Layout::kUyvy, 8},
    FormatInfo{RawFormat::kMono10Csi2, "Mono10Csi2", PixelFormat::kGrey8, Layout::kCsi2, 10},
    FormatInfo{RawFormat::kBayerGr10Csi2, "BayerGR10Csi2", PixelFormat::kBayerGr8, Layout::kCsi2, 10},
    FormatInfo{RawFormat::kBayerRg10Csi2, "BayerRG10Csi2", PixelFormat::kBayerRg8, Layout::kCsi2, 10},
    FormatInfo{RawFormat::kBayerGb10Csi2, "BayerGB10Csi2", PixelFormat::kBayerGb8, Layout::kCsi2, 10},
    FormatInfo{RawFormat::kBayerBg10Csi2, "BayerBG10Csi2", PixelFormat::kBayerBg8, Layout::kCsi2, 10},
    FormatInfo{RawFormat::kMono12Csi2, "Mono12Csi2", PixelFormat::kGrey8, Layout::kCsi2, 12},
    FormatInfo{RawFormat::kBayerGr12Csi2, "BayerGR12Csi2", PixelFormat::kBayerGr8, Layout::kCsi2, 12},
    FormatInfo{RawFormat::kBayerRg12Csi2, "BayerRG12Csi2", PixelFormat::kBayerRg8, Layout::kCsi2, 12},
    FormatInfo{RawFormat::kBayerGb12Csi2, "BayerGB12Csi2", PixelFormat::kBayerGb8, Layout::kCsi2, 12},
    FormatInfo{RawFormat::kBayerBg12Csi2, "BayerBG12Csi2", PixelFormat::kBayerBg8, Layout::kCsi2, 12},
    FormatInfo{RawFormat::kMotionJpeg, "MJPEG", PixelFormat::kRgb8, Layout::kJpeg, 8},
};

const FormatInfo* InfoOf(RawFormat format) {
  for (const FormatInfo& info : kFormats)
    if (info.format == format) return &info;
  return nullptr;
}

int BitsPerPixel(RawFormat format) { return static_cast<int>(static_cast<uint32_t>(format) >> 16 & 0xff); }

// The eight bits of a value below the highest of `used`; what needs more is white.
uint8_t EightBits(unsigned value, int used) {
  return static_cast<uint8_t>(std::min(value >> (used - 8), 255u));
}

// Which bits of the values of a frame count. `value_at(i)` gives the i-th, of `bits`.
template <typename ValueAt>
int CountUsed(size_t values, int bits, DeepBits deep, const ValueAt& value_at) {
  if (deep == DeepBits::kUpper) return bits;
  // Odd, so that both kinds of a mosaic's columns are met.
  constexpr size_t kStep = 7;
  BitsInUse used;
  for (size_t i = 0; i < values; i += kStep) used.Add(static_cast<uint16_t>(value_at(i)));
  return std::min(used.Count(), bits);
}

template <typename ValueAt>
void TakeEightBits(int bits, DeepBits deep, const ValueAt& value_at, std::vector<uint8_t>& out) {
  const int used = CountUsed(out.size(), bits, deep, value_at);
  for (size_t i = 0; i < out.size(); ++i) out[i] = EightBits(value_at(i), used);
}

void BitsOfWords(const uint8_t* in, int bits, DeepBits deep, std::vector<uint8_t>& out) {
  const unsigned mask = (1u << bits) - 1;
  TakeEightBits(
      bits, deep, [=](size_t i) { return (in[2 * i] | in[2 * i + 1] << 8) & mask; }, out);
}

// `size` bytes at `in`.
void BitsOfBitStream(const uint8_t* in, size_t size, int bits, DeepBits deep, std::vector<uint8_t>& out) {
  const unsigned mask = (1u << bits) - 1;
  const auto value_at = [=](size_t i) {
    const size_t first_bit = i * bits, at = first_bit / 8;
    const unsigned pair = in[at] | (at + 1 < size ? in[at + 1] << 8 : 0);
    return pair >> (first_bit % 8) & mask;
  };
  TakeEightBits(bits, deep, value_at, out);
}

// Two pixels in 3 bytes: the middle one has the lower bits, those of the first pixel below.
void BitsOfPairs(const uint8_t* in, int bits, DeepBits deep, std::vector<uint8_t>& out) {
  const int lower = bits - 8;
  const auto value_at = [=](size_t i) {
    const uint8_t* pair = in + i / 2 * 3;
    const unsigned rest = pair[1] >> (i % 2 * 4) & ((1u << lower) - 1);
    return static_cast<unsigned>(pair[i % 2 * 2]) << lower | rest;
  };
  TakeEightBits(bits, deep, value_at, out);
}

// The upper bytes of a group of pixels stand before the byte with their lower bits, the first pixel's lowest.
// `size` bytes at `in`: a last group that is not full may lack that byte.
void BitsOfCsi2(const uint8_t* in, size_t size, int bits, DeepBits deep, std::vector<uint8_t>& out) {
  const int lower = bits - 8;
  const size_t group = bits == 10 ? 4 : 2;
  const auto value_at = [=](size_t i) {
    const size_t first = i / group * (group + 1), last = first + group;
    const unsigned rest = last < size ? in[last] >> (i % group * static_cast<size_t>(lower)) : 0u;
    return static_cast<unsigned>(in[first + i % group]) << lower | (rest & ((1u << lower) - 1));
  };
  TakeEightBits(bits, deep, value_at, out);
}

absl::Status DecodeJpegFrame(const RawFrame& raw, std::vector<uint8_t>& out) {
  const absl::StatusOr<ImageHeader> header = ReadImageHeader({raw.bytes->data(), raw.bytes->size()});
  if (!header.ok() || header->format != ImageFormat::kJpeg)
    return absl::InvalidArgumentError(absl::StrCat("camera ", raw.camera_id, ": not a JPEG image"));
  // Before pixels are decoded: a small frame may announce an image that fills the memory.
  if (header->width_px != raw.width_px || header->height_px != raw.height_px) {
    return absl::InvalidArgumentError(absl::StrCat("camera ", raw.camera_id, ": JPEG is ", header->width_px,
                                                   "x", header->height_px, ", expected ", raw.width_px, "x",
                                                   raw.height_px));
  }
  const absl::StatusOr<DecodedImage> image =
      DecodeJpeg({raw.bytes->data(), raw.bytes->size()}, JpegOrigin::kCamera);
  if (!image.ok())
    return absl::InvalidArgumentError(absl::StrCat("camera ", raw.camera_id, ": ", image.status().message()));
  if (image->channels == 3) {
    std::copy(image->values.begin(), image->values.end(), out.begin());
  } else {
    for (size_t i = 0; i < image->values.size(); ++i) std::fill_n(out.data() + 3 * i, 3, image->values[i]);
  }
  return absl::OkStatus();
}

void ConvertColour(const RawFrame& raw, int type, int code, std::vector<uint8_t>& out) {
  const cv::Mat in(raw.height_px, raw.width_px, type, const_cast<uint8_t*>(raw.bytes->data()));
  cv::Mat rgb(raw.height_px, raw.width_px, CV_8UC3, out.data());
  cv::cvtColor(in, rgb, code);
}

absl::Status Convert(const RawFrame& raw, const FormatInfo& info, DeepBits deep, std::vector<uint8_t>& out) {
  const uint8_t* in = raw.bytes->data();
  switch (info.layout) {
    case Layout::kBytes:
      std::memcpy(out.data(), in, out.size());
      break;
    case Layout::kWords:
      BitsOfWords(in, info.bits, deep, out);
      break;
    case Layout::kBitStream:
      BitsOfBitStream(in, raw.bytes->size(), info.bits, deep, out);
      break;
    case Layout::kPairsIn3Bytes:
      BitsOfPairs(in, info.bits, deep, out);
      break;
    case Layout::kCsi2:
      BitsOfCsi2(in, raw.bytes->size(), info.bits, deep, out);
      break;
    case Layout::kBgr:
      ConvertColour(raw, CV_8UC3, cv::COLOR_BGR2RGB, out);
      break;
    case Layout::kYuyv:
      ConvertColour(raw, CV_8UC2, cv::COLOR_YUV2RGB_YUYV, out);
      break;
    case Layout::kUyvy:
      ConvertColour(raw, CV_8UC2, cv::COLOR_YUV2RGB_UYVY, out);
      break;
    case Layout::kJpeg:
      return DecodeJpegFrame(raw, out);
  }
  return absl::OkStatus();
}

}  // namespace

std::string_view RawFormatName(RawFormat format) {
  const FormatInfo* info = InfoOf(format);
  return info ? info->name : std::string_view{};
}

absl::StatusOr<RawFormat> RawFormatFromName(std::string_view name) {
  std::string known;
  for (const FormatInfo& info : kFormats) {
    if (info.name == name) return info.format;
    absl::StrAppend(&known, known.empty() ? "" : ", ", std::string(info.name));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("pixel format \"", std::string(name), "\" is unknown; expected one of ", known));
}

bool IsRawFormat(uint32_t code) { return InfoOf(static_cast<RawFormat>(code)) != nullptr; }

uint64_t RawBytes(RawFormat format, int width_px, int height_px) {
  if (format == RawFormat::kMotionJpeg) return 0;
  return (static_cast<uint64_t>(width_px) * height_px * BitsPerPixel(format) + 7) / 8;
}

absl::Status RawFrame::Validate() const {
  const FormatInfo* info = InfoOf(format);
  if (info == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("camera ", camera_id, ": pixel format 0x",
                                                   absl::Hex(static_cast<uint32_t>(format)),
                                                   " is not supported"));
  }
  if (width_px <= 0 || height_px <= 0 || width_px > kMaxSide_px || height_px > kMaxSide_px) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", camera_id, ": image size ", width_px, "x", height_px, " is out of range"));
  }
  const uint64_t have = bytes ? bytes->size() : 0;
  const uint64_t expected = RawBytes(format, width_px, height_px);
  if (info->layout == Layout::kJpeg ? have == 0 : have != expected) {
    return absl::InvalidArgumentError(absl::StrCat("camera ", camera_id, ": ", have, " bytes, expected ",
                                                   expected, " for ", width_px, "x", height_px, " ",
                                                   std::string(info->name)));
  }
  if ((info->layout == Layout::kYuyv || info->layout == Layout::kUyvy) && width_px % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", camera_id, ": YUV 4:2:2 needs an even width, not ", width_px));
  }
  return absl::OkStatus();
}

uint64_t RawFrameSet::bytes() const {
  uint64_t sum = 0;
  for (const RawFrame& frame : frames) sum += frame.bytes ? PaddedBytes(frame.bytes->size()) : 0;
  return sum;
}

absl::StatusOr<Frame> ToFrame(const RawFrame& raw, DeepBits deep) {
  WEFT_RETURN_IF_ERROR(raw.Validate());
  const FormatInfo& info = *InfoOf(raw.format);
  auto pixels = std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(raw.width_px) * raw.height_px *
                                                       BytesPerPixel(info.pixels));
  WEFT_RETURN_IF_ERROR(Convert(raw, info, deep, *pixels));
  Frame frame;
  frame.camera_id = raw.camera_id;
  frame.width_px = raw.width_px;
  frame.height_px = raw.height_px;
  frame.format = info.pixels;
  frame.pixels = std::move(pixels);
  frame.device_time_ns = raw.device_time_ns;
  return frame;
}

RawFormat RawFormatOf(PixelFormat format) {
  RawFormat raw = RawFrame().format;
  for (const FormatInfo& info : kFormats)
    if (info.pixels == format && info.layout == Layout::kBytes) raw = info.format;
  return raw;
}

absl::StatusOr<RawFrame> ToRawFrame(const Frame& frame) {
  WEFT_RETURN_IF_ERROR(frame.Validate());
  RawFrame raw;
  raw.format = RawFormatOf(frame.format);
  raw.camera_id = frame.camera_id;
  raw.width_px = frame.width_px;
  raw.height_px = frame.height_px;
  raw.device_time_ns = frame.device_time_ns;
  auto bytes = std::make_shared<AlignedBuffer>(frame.pixels->size());
  std::memcpy(bytes->data(), frame.pixels->data(), frame.pixels->size());
  raw.bytes = std::move(bytes);
  return raw;
}

}  // namespace weft
