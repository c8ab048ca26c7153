#include "capture/image/image_size.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

TEST(ImageSizes, OfAnErrorSurviveMoreWords) {
  const absl::Status status = StatusAt("take", WrongSizeError("c01.png", {{640, 480}, {800, 600}}));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "take: c01.png: image is 640x480, the rig says 800x600");
  const auto sizes = WrongSizeOf(status);
  ASSERT_TRUE(sizes);
  EXPECT_EQ(sizes->found, (ImageSize{640, 480}));
  EXPECT_EQ(sizes->expected, (ImageSize{800, 600}));
}

TEST(ImageSizes, OfOtherErrorsAreNone) {
  EXPECT_FALSE(WrongSizeOf(absl::OkStatus()));
  EXPECT_FALSE(WrongSizeOf(absl::InvalidArgumentError("image is 640x480, the rig says 800x600")));
  EXPECT_EQ(WrongSizeError("", {{1, 2}, {3, 4}}).message(), "image is 1x2, the rig says 3x4");
}

}  // namespace
}  // namespace weft
