#include <linux/videodev2.h>

#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/camera/v4l2_device.h"

namespace weft {
namespace {

constexpr std::array kCodes = {
    std::pair{RawFormat::kMono8, uint32_t{V4L2_PIX_FMT_GREY}},
    std::pair{RawFormat::kMono10, uint32_t{V4L2_PIX_FMT_Y10}},
    std::pair{RawFormat::kMono12, uint32_t{V4L2_PIX_FMT_Y12}},
    std::pair{RawFormat::kMono16, uint32_t{V4L2_PIX_FMT_Y16}},
    std::pair{RawFormat::kMono10Csi2, uint32_t{V4L2_PIX_FMT_Y10P}},
    std::pair{RawFormat::kBayerGr8, uint32_t{V4L2_PIX_FMT_SGRBG8}},
    std::pair{RawFormat::kBayerRg8, uint32_t{V4L2_PIX_FMT_SRGGB8}},
    std::pair{RawFormat::kBayerGb8, uint32_t{V4L2_PIX_FMT_SGBRG8}},
    std::pair{RawFormat::kBayerBg8, uint32_t{V4L2_PIX_FMT_SBGGR8}},
    std::pair{RawFormat::kBayerGr10, uint32_t{V4L2_PIX_FMT_SGRBG10}},
    std::pair{RawFormat::kBayerRg10, uint32_t{V4L2_PIX_FMT_SRGGB10}},
    std::pair{RawFormat::kBayerGb10, uint32_t{V4L2_PIX_FMT_SGBRG10}},
    std::pair{RawFormat::kBayerBg10, uint32_t{V4L2_PIX_FMT_SBGGR10}},
    std::pair{RawFormat::kBayerGr12, uint32_t{V4L2_PIX_FMT_SGRBG12}},
    std::pair{RawFormat::kBayerRg12, uint32_t{V4L2_PIX_FMT_SRGGB12}},
    std::pair{RawFormat::kBayerGb12, uint32_t{V4L2_PIX_FMT_SGBRG12}},
    std::pair{RawFormat::kBayerBg12, uint32_t{V4L2_PIX_FMT_SBGGR12}},
    std::pair{RawFormat::kBayerGr10Csi2, uint32_t{V4L2_PIX_FMT_SGRBG10P}},
    std::pair{RawFormat::kBayerRg10Csi2, uint32_t{V4L2_PIX_FMT_SRGGB10P}},
    std::pair{RawFormat::kBayerGb10Csi2, uint32_t{V4L2_PIX_FMT_SGBRG10P}},
    std::pair{RawFormat::kBayerBg10Csi2, uint32_t{V4L2_PIX_FMT_SBGGR10P}},
    std::pair{RawFormat::kBayerGr12Csi2, uint32_t{V4L2_PIX_FMT_SGRBG12P}},
    std::pair{RawFormat::kBayerRg12Csi2, uint32_t{V4L2_PIX_FMT_SRGGB12P}},
    std::pair{RawFormat::kBayerGb12Csi2, uint32_t{V4L2_PIX_FMT_SGBRG12P}},
    std::pair{RawFormat::kBayerBg12Csi2, uint32_t{V4L2_PIX_FMT_SBGGR12P}},
    std::pair{RawFormat::kRgb8, uint32_t{V4L2_PIX_FMT_RGB24}},
    std::pair{RawFormat::kBgr8, uint32_t{V4L2_PIX_FMT_BGR24}},
    std::pair{RawFormat::kYuyv, uint32_t{V4L2_PIX_FMT_YUYV}},
    std::pair{RawFormat::kUyvy, uint32_t{V4L2_PIX_FMT_UYVY}},
    std::pair{RawFormat::kMotionJpeg, uint32_t{V4L2_PIX_FMT_MJPEG}},
};

}  // namespace

absl::StatusOr<RawFormat> RawFormatOfV4l2(uint32_t code) {
  if (code == V4L2_PIX_FMT_JPEG) return RawFormat::kMotionJpeg;
  for (const auto& [format, known] : kCodes)
    if (known == code) return format;
  return absl::InvalidArgumentError(
      absl::StrCat("images of format ", V4l2CodeText(code), " are not supported"));
}

std::string V4l2CodeText(uint32_t code) {
  std::string text;
  for (int byte = 0; byte < 4; ++byte) text += static_cast<char>(code >> (8 * byte) & 0x7f);
  if ((code & 0x80000000) != 0) text += "-BE";
  return text;
}

}  // namespace weft
