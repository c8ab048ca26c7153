#include "capture/rig/colmap_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/rig/exchanged_rig.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kFourLenses[] =
    "1 PINHOLE 600 800 4000 4000 300 400\n2 PINHOLE 600 800 4000 4000 300 400\n"
    "3 PINHOLE 600 800 4000 4000 300 400\n4 PINHOLE 600 800 4000 4000 300 400\n";

TEST(ColmapText, ComesBackTheSame) {
  const Rig rig = TwoCameras(true);
  const auto text = FormatColmapText(rig);
  ASSERT_TRUE(text.ok()) << text.status();
  const auto back = ParseColmapText(text->cameras, text->images, "sparse");
  ASSERT_TRUE(back.ok()) << back.status();
  ExpectSame(back->rig, rig);
}

TEST(ColmapText, PixelsStartAtTheCornerOfTheFirst) {
  const auto rig = ParseColmapText("1 SIMPLE_RADIAL 640 480 700 320.5 240.5 -0.1\n",
                                   "7 1 0 0 0 0 0 5 1 cam3.jpg\n10 20 -1 30 40 -1\n", "sparse");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->rig.cameras[0].cx_px, 320);
  EXPECT_EQ(rig->rig.cameras[0].cy_px, 240);
  EXPECT_EQ(rig->rig.cameras[0].fy_px, 700);
  EXPECT_EQ(rig->rig.cameras[0].distortion[0], -0.1);
  EXPECT_EQ(rig->rig.cameras[0].id, "cam3");
}

TEST(ColmapText, NamesFileAndLine) {
  const auto message = [](const std::string& cameras, const std::string& images) {
    const auto rig = ParseColmapText(cameras, images, "sparse");
    EXPECT_EQ(rig.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(rig.status().message());
  };
  EXPECT_THAT(
      message("# c\n1 DIVISION 640 480 1 2 3\n", ""),
      AllOf(HasSubstr("sparse/cameras.txt: line 2: the model DIVISION"), HasSubstr("OPENCV_FISHEYE")));
  EXPECT_THAT(message("1 PINHOLE 640 480 700 700 320\n", ""),
              HasSubstr("sparse/cameras.txt: line 1: expected 4 numbers"));
  EXPECT_THAT(message("1 PINHOLE 640 480 700 700 320 240\n", "1 1 0 0 0 0 0 5 2 a.png\n"),
              HasSubstr("sparse/images.txt: line 1"));
}

TEST(ColmapText, TheLineOfPointsMayBeMissing) {
  for (const char* between : {"\n", "\n\n", "\n10.5 20 -1 30 40 7\n", "\n# comment\n", "\n\n\n"}) {
    std::string images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n";
    for (int i = 1; i <= 4; ++i)
      images += std::to_string(i) + " 1 0 0 0 0 0 1500 " + std::to_string(i) + " c" + std::to_string(i) +
                ".png" + between;
    EXPECT_THAT(IdsOf(ParseColmapText(kFourLenses, images, "sparse")), ElementsAre("c1", "c2", "c3", "c4"));
  }
  const auto two = ParseColmapText(kFourLenses, "1 1 0 0 0 0 0 5 1 a.png\n1 2 -1\n3 4 -1\n", "sparse");
  EXPECT_THAT(std::string(two.status().message()), HasSubstr("images.txt: line 3"));
}

TEST(ColmapText, PathsNameTheCamera) {
  const auto ids = [](const std::string& a, const std::string& b) {
    return IdsOf(
        ParseColmapText(kFourLenses, "1 1 0 0 0 0 0 5 1 " + a + "\n2 1 0 0 0 9 0 5 2 " + b + "\n", "sparse"));
  };
  EXPECT_THAT(ids("left.jpg", "right.jpg"), ElementsAre("left", "right"));
  EXPECT_THAT(ids("0000/left.jpg", "0000/right.jpg"), ElementsAre("left", "right"));
  EXPECT_THAT(ids("left/0000.jpg", "right/0000.jpg"), ElementsAre("left", "right"));
  EXPECT_THAT(ids("cam400002/image0000.png", "cam400004/image0000.png"), ElementsAre("400002", "400004"));
  EXPECT_THAT(ids("a b.png", "c d.png"), ElementsAre("a b", "c d"));
  EXPECT_THAT(ids("take/left\\1.png", "take/right\\1.png"), ElementsAre("left", "right"));
  EXPECT_THAT(ids("cam1/images/0001.png", "cam2/images/0001.png"), ElementsAre("cam1", "cam2"));
  const auto one = [](const std::string& path) {
    return IdsOf(ParseColmapText(kFourLenses, "1 1 0 0 0 0 0 5 1 " + path + "\n", "sparse"));
  };
  EXPECT_THAT(one("cam1/0001.png"), ElementsAre("cam1"));
  EXPECT_THAT(one("images/0001.png"), ElementsAre("0001"));
  EXPECT_THAT(one("0001/cam1.png"), ElementsAre("cam1"));
  const auto several = ParseColmapText(
      kFourLenses, "1 1 0 0 0 0 0 5 1 a/1.png\n2 1 0 0 0 9 0 5 2 a/2.png\n3 1 0 0 0 9 9 5 3 b/3.png\n",
      "sparse");
  EXPECT_THAT(IdsOf(several), ElementsAre("1", "2", "3"));
  EXPECT_THAT(several->remarks, testing::Contains(HasSubstr("images lie in 2 folders")));
}

TEST(ColmapText, LensesAreReadOrNamed) {
  const std::string image = "1 1 0 0 0 0 0 5 1 a.png\n";
  const auto lens = [&](const std::string& line) { return ParseColmapText(line, image, "sparse"); };
  const auto fisheye = lens("1 OPENCV_FISHEYE 1280 1024 700 700 640.5 512.5 0.08 -0.02 0.006 -0.001\n");
  ASSERT_TRUE(fisheye.ok()) << fisheye.status();
  EXPECT_THAT(fisheye->remarks, ElementsAre(HasSubstr("OPENCV_FISHEYE, is held to")));
  // theta + 0.08 theta^3 - ..., at 45 degrees, by hand.
  EXPECT_NEAR(fisheye->rig.cameras[0].Project({1, 0, -4})->x(), 640 + 700 * 0.8191714, 0.01);
  for (const char* line :
       {"1 SIMPLE_RADIAL_FISHEYE 1280 1024 700 640 512 0.01\n",
        "1 RADIAL_FISHEYE 1280 1024 700 640 512 0.01 0\n", "1 FOV 1280 1024 700 700 640 512 0.5\n",
        "1 SIMPLE_FISHEYE 1280 1024 700 640 512\n",
        "1 THIN_PRISM_FISHEYE 1280 1024 700 700 640 512 0.01 0 0 0 0 0 0 0\n"}) {
    EXPECT_TRUE(lens(line).ok()) << line << lens(line).status();
  }
  EXPECT_THAT(
      std::string(
          lens("1 THIN_PRISM_FISHEYE 1280 1024 700 700 640 512 0 0 1e-3 0 0 0 0 0\n").status().message()),
      HasSubstr("tangential or thin prism"));
  EXPECT_THAT(std::string(lens("1 PINHOLE 640 480 700 700 320 240 0.1\n").status().message()),
              HasSubstr("has 4 parameters, here are 5"));
  EXPECT_THAT(
      std::string(
          lens("1 PINHOLE 640 480 700 700 320 240\n1 PINHOLE 64 48 70 70 32 24\n").status().message()),
      HasSubstr("occurs twice"));
  EXPECT_THAT(
      std::string(ParseColmapText("1 PINHOLE 640 480 700 700 320 240\n", "1 1 1 0 0 0 0 5 1 a.png\n", "s")
                      .status()
                      .message()),
      HasSubstr("has the length 1.414"));
  const auto spare = ParseColmapText(kFourLenses, image, "sparse");
  ASSERT_TRUE(spare.ok());
  EXPECT_THAT(spare->remarks, SizeIs(3));
}

}  // namespace
}  // namespace weft
