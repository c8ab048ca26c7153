// What needs no camera; the rest is in tests/system/v4l2_guest.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <vector>

#include "capture/camera/v4l2_camera.h"

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

TEST(V4l2Stream, JpegIsWholeFromItsFirstMarkerToItsLast) {
  std::vector<uint8_t> jpeg = {0xff, 0xd8, 1, 2, 3, 0xff, 0xd9, 0, 0};
  EXPECT_EQ(WholeJpegBytes(jpeg.data(), jpeg.size()), 7u);
  EXPECT_EQ(WholeJpegBytes(jpeg.data(), 6), 0u);
  EXPECT_EQ(WholeJpegBytes(jpeg.data() + 1, 6), 0u);
  EXPECT_EQ(WholeJpegBytes(jpeg.data(), 0), 0u);
}

TEST(V4l2Stream, PaddingOfLinesIsLeftOut) {
  const std::vector<uint8_t> padded = {1, 2, 3, 99, 4, 5, 6, 99, 7, 8, 9};
  std::vector<uint8_t> image(9);
  CopyLines(padded.data(), 4, 3, 3, image.data());
  EXPECT_EQ(image, (std::vector<uint8_t>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST(V4l2Camera, SaysWhichDeviceIsNotThere) {
  V4l2CameraOptions options;
  options.id = "usb";
  options.device = "/dev/no such camera";
  absl::Status status = OpenV4l2Camera(options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("camera usb: /dev/no such camera"));
  options.device = "/dev/null";
  EXPECT_THAT(std::string(OpenV4l2Camera(options).status().message()), HasSubstr("it is no V4L2 camera"));
  options.device = "No Such Webcam";
  EXPECT_THAT(std::string(OpenV4l2Camera(options).status().message()), HasSubstr("called No Such Webcam"));
  options.buffers = 1;
  EXPECT_EQ(OpenV4l2Camera(options).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
