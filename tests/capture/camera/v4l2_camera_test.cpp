// What needs no camera; the rest is in tests/system/v4l2_guest.cpp.
#include "capture/camera/v4l2_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

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
