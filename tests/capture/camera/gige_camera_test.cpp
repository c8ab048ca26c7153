#include "capture/camera/gige_camera.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(GigeCameraOptions, NameTheCameraAndTheFault) {
  GigeCameraOptions options;
  EXPECT_FALSE(options.Validate().ok());
  options.id = "left";
  options.device = "192.168.1.11";
  options.features = {"Width=512", "UserSetSelector=Default=1"};
  EXPECT_TRUE(options.Validate().ok());
  options.features.emplace_back("=3");
  EXPECT_EQ(options.Validate().message(), "camera left: feature \"=3\" is not of the form Name=value");
}

}  // namespace
}  // namespace weft
