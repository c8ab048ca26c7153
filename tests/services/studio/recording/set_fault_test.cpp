#include "services/studio/recording/set_fault.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace weft {
namespace {

TEST(FaultOfSet, IsNoneWhereEachCameraIsAccountedForOnce) {
  RawFrameSet set;
  set.number = 6;
  set.missing = {{"a", "no frame"}, {"b", "no frame"}};
  EXPECT_EQ(FaultOfSet(set, {"a", "b"}, 5), "");
  EXPECT_EQ(FaultOfSet(set, {"a", "b"}, std::nullopt), "");
}

TEST(FaultOfSet, IsANumberThatDoesNotRise) {
  RawFrameSet set;
  set.number = 5;
  EXPECT_EQ(FaultOfSet(set, {}, 5), "its number is not after 5");
  EXPECT_EQ(FaultOfSet(set, {}, 7), "its number is not after 7");
}

TEST(FaultOfSet, IsACameraThatIsForgottenOrThereTwice) {
  RawFrameSet set;
  set.missing = {{"a", "no frame"}};
  EXPECT_EQ(FaultOfSet(set, {"a", "b"}, std::nullopt), "it accounts for camera b 0 times");
  RawFrame frame;
  frame.camera_id = "a";
  set.frames.push_back(frame);
  EXPECT_EQ(FaultOfSet(set, {"a"}, std::nullopt), "it accounts for camera a 2 times");
}

TEST(FaultOfSet, IsAFrameWithoutPixels) {
  RawFrameSet set;
  RawFrame frame;
  frame.camera_id = "a";
  set.frames.push_back(frame);
  EXPECT_NE(FaultOfSet(set, {"a"}, std::nullopt), "");
}

}  // namespace
}  // namespace weft
