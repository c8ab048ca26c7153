#include "services/studio/recording/camera_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::StartsWith;

TEST(CameraList, HasALineForEachAndMoreWhereAsked) {
  v1::CameraList list;
  v1::ListedCamera& gige = *list.add_cameras();
  gige.set_kind("gige");
  gige.set_device("10.0.0.2");
  gige.set_model("Maker M1");
  gige.set_serial("7");
  gige.set_used_by("another program");
  v1::ListedCamera& v4l2 = *list.add_cameras();
  v4l2.set_kind("v4l2");
  v4l2.set_device("/dev/video0");
  v4l2.set_bus("usb-1");
  v4l2.add_formats("YUYV 640x480");
  v4l2.add_controls("gain 0 to 9");
  EXPECT_EQ(CameraListText(list, false),
            "gige  10.0.0.2  Maker M1, serial 7  in use: another program\n"
            "v4l2  /dev/video0, at usb-1\n");
  EXPECT_EQ(CameraListText(list, true),
            "gige  10.0.0.2  Maker M1, serial 7  in use: another program\n"
            "v4l2  /dev/video0, at usb-1\n"
            "      YUYV 640x480\n"
            "      gain 0 to 9\n");
}

TEST(CameraList, SaysThatThereIsNone) { EXPECT_THAT(CameraListText({}, true), StartsWith("no camera: ")); }

}  // namespace
}  // namespace weft
