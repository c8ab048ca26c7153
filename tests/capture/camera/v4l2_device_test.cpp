#include "capture/camera/v4l2_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(V4l2Formats, KnowsCodesOfV4l2) {
  EXPECT_EQ(*RawFormatOfV4l2(V4L2_PIX_FMT_YUYV), RawFormat::kYuyv);
  EXPECT_EQ(*RawFormatOfV4l2(V4L2_PIX_FMT_SRGGB10P), RawFormat::kBayerRg10Csi2);
  EXPECT_EQ(*RawFormatOfV4l2(V4L2_PIX_FMT_JPEG), RawFormat::kMotionJpeg);
  EXPECT_EQ(V4l2CodeText(V4L2_PIX_FMT_Y10), "Y10 ");
  EXPECT_THAT(std::string(RawFormatOfV4l2(V4L2_PIX_FMT_NV12).status().message()), HasSubstr("NV12"));
}

}  // namespace
}  // namespace weft
