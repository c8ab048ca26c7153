#include "capture/rig/krt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/capture/rig/exchanged_rig.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

const char kTwoCameras[] = R"(400002
4000.5 0 1185.25
0 4001.5 2049
0 0 1
-0.1 0.2 0.001 -0.002 0
1 0 0 10
0 0 -1 20
0 1 0 3000

400004
9000 0 900
0 9001 2000
0 0 1
0 0 0 0 0.5
1 0 0 0
0 1 0 0
0 0 1 100
)";

TEST(ParseKrt, ReadsIntrinsicsDistortionAndPose) {
  const auto rig = ParseKrt(kTwoCameras, "KRT", 2668, 4096);
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 2u);
  const CameraModel& camera = rig->cameras[0];
  EXPECT_EQ(camera.id, "400002");
  EXPECT_EQ(camera.width_px, 2668);
  EXPECT_EQ(camera.height_px, 4096);
  EXPECT_EQ(camera.fx_px, 4000.5);
  EXPECT_EQ(camera.cy_px, 2049);
  EXPECT_EQ(camera.distortion[3], -0.002);
  EXPECT_EQ(camera.translation_mm, Eigen::Vector3d(10, 20, 3000));
  // A point of the world y axis lies along the camera's z axis.
  EXPECT_EQ((camera.rotation * Eigen::Vector3d(0, 5, 0)).z(), 5);
  EXPECT_EQ(rig->cameras[1].distortion[4], 0.5);
}

TEST(ParseKrt, AcceptsWindowsLineEndings) {
  std::string text;
  for (const char c : std::string(kTwoCameras)) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_TRUE(ParseKrt(text, "KRT", 2668, 4096).ok());
}

TEST(ParseKrt, NamesFileAndLineOfWhatIsWrong) {
  const auto message = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    const auto rig = ParseKrt(text, "studio/KRT", 2668, 4096);
    EXPECT_EQ(rig.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(rig.status().message());
  };
  EXPECT_THAT(message(kTwoCameras, "0 4001.5 2049", "0 4001.5"), HasSubstr("studio/KRT: line 3"));
  EXPECT_THAT(message(kTwoCameras, "0.001", "zero"), HasSubstr("\"zero\" is not a number"));
  EXPECT_THAT(message(kTwoCameras, "0.001", "nan"), HasSubstr("line 5"));
  EXPECT_THAT(message(kTwoCameras, "4000.5 0 ", "4000.5 3 "), HasSubstr("skew"));
  EXPECT_THAT(message(kTwoCameras, "400004", "400002"), HasSubstr("400002 occurs twice"));
  EXPECT_THAT(message(kTwoCameras, "0 0 1 100\n", ""),
              HasSubstr("the file ends where [R|t] row 2 of camera 400004"));
  EXPECT_THAT(message(kTwoCameras, "1 0 0 10", "2 0 0 10"), HasSubstr("rotation"));
}

TEST(ParseKrt, RejectsEmptyTextAndPathsAsIds) {
  EXPECT_FALSE(ParseKrt("", "KRT", 10, 10).ok());
  EXPECT_FALSE(ParseKrt("../../etc\n", "KRT", 10, 10).ok());
}

TEST(Krt, MayHaveCommentsAndCommas) {
  const auto rig = ParseKrt(
      "# made by hand\ncam#1  # front\n4000, 0, 1185\n[0 4001 2049;\n  # K ends\n0 0 1]\n"
      "-0.1,0.2,0,0,0\n1 0 0 10\n0\t1,0 20\n0 0 1 3000 # mm\n",
      "KRT", 2668, 4096);
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras[0].id, "cam#1");
  EXPECT_EQ(rig->cameras[0].fy_px, 4001);
  EXPECT_EQ(rig->cameras[0].translation_mm, Eigen::Vector3d(10, 20, 3000));
  // A decimal comma makes a number too many.
  EXPECT_THAT(std::string(ParseKrt("a\n4000,5 0 1185\n", "KRT", 9, 9).status().message()),
              HasSubstr("has 4 numbers, expected 3"));
}

TEST(ParseKrt, KeepsEveryDigitThereAndBack) {
  const Rig rig = TwoCameras(false);
  const auto back = ParseKrt(FormatKrt(rig).value(), "KRT", 2668, 4096);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->ContentHash(), rig.ContentHash());
  EXPECT_THAT(std::string(FormatKrt(TwoCameras(true)).status().message()), HasSubstr("k4 k5 k6"));
}

}  // namespace
}  // namespace weft
