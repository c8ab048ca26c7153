// Rigs in the formats of others, there and back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "capture/rig/colmap_text.h"
#include "capture/rig/krt.h"
#include "capture/rig/opencv_yaml.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

Rig TwoCameras(bool rational) {
  Rig rig;
  for (int i = 0; i < 2; ++i) {
    CameraModel camera;
    camera.id = i == 0 ? "400002" : "left";
    camera.width_px = 2668;
    camera.height_px = 4096;
    camera.fx_px = 4000.1 / 3 + i;
    camera.fy_px = 4001.7 / 3;
    camera.cx_px = 1185.25 + 1e-9;
    camera.cy_px = 2049.0 / 7;
    camera.distortion = {-0.1, 0.2 / 3, 1e-3, -2e-3 / 7, 0.05, 0, 0, 0};
    if (rational) camera.distortion[5] = 0.01, camera.distortion[7] = -0.002;
    camera.rotation = Eigen::AngleAxisd(0.7 + i, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    camera.translation_mm = {10.0 / 3, -20, 3000.123456789};
    rig.cameras.push_back(camera);
  }
  return rig;
}

void ExpectSame(const Rig& a, const Rig& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    const CameraModel &x = a.cameras[i], &y = b.cameras[i];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(x.width_px, y.width_px);
    EXPECT_EQ(x.height_px, y.height_px);
    for (int k = 0; k < 8; ++k) EXPECT_EQ(x.distortion[k], y.distortion[k]);
    EXPECT_LT((x.rotation - y.rotation).norm(), 1e-14);
    for (const Eigen::Vector3d& point : {Eigen::Vector3d(3, 50, 90), Eigen::Vector3d(-80, 20, -40)}) {
      EXPECT_LT((x.Project(point).value() - y.Project(point).value()).norm(), 1e-9);
    }
  }
}

TEST(RigExchange, KrtKeepsEveryDigit) {
  const Rig rig = TwoCameras(false);
  const auto back = ParseKrt(FormatKrt(rig).value(), "KRT", 2668, 4096);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->ContentHash(), rig.ContentHash());
  EXPECT_THAT(std::string(FormatKrt(TwoCameras(true)).status().message()), HasSubstr("k4 k5 k6"));
}

TEST(RigExchange, OpenCvYamlKeepsEveryDigit) {
  for (const bool rational : {false, true}) {
    const Rig rig = TwoCameras(rational);
    const auto text = FormatOpenCvYaml(rig);
    ASSERT_TRUE(text.ok()) << text.status();
    const auto back = ParseOpenCvYaml(*text, "rig.yml");
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(back->ContentHash(), rig.ContentHash());
  }
}

TEST(RigExchange, ReadsTheFileOfOpenCvsCalibrationOfOneCamera) {
  cv::FileStorage file(".yml",
                       cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  file << "image_width" << 640 << "image_height" << 480;
  file << "camera_matrix" << cv::Mat((cv::Mat_<double>(3, 3) << 700, 0, 320, 0, 710, 240, 0, 0, 1));
  file << "distortion_coefficients" << cv::Mat((cv::Mat_<double>(5, 1) << -0.2, 0.1, 0, 0, 0.01));
  const auto rig = ParseOpenCvYaml(file.releaseAndGetString(), "one.yml");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 1u);
  EXPECT_EQ(rig->cameras[0].id, "camera0");
  EXPECT_EQ(rig->cameras[0].fy_px, 710);
  EXPECT_EQ(rig->cameras[0].distortion[4], 0.01);
}

TEST(RigExchange, OpenCvYamlNamesWhatIsMissing) {
  const auto message = [](const std::string& text) {
    return std::string(ParseOpenCvYaml(text, "rig.yml").status().message());
  };
  EXPECT_THAT(message("%YAML:1.0\n---\nimage_width: 640\n"), HasSubstr("image_height"));
  EXPECT_THAT(message("no yaml at all"), HasSubstr("rig.yml"));
  std::string text = FormatOpenCvYaml(TwoCameras(false)).value();
  text.replace(text.find("camera_matrix"), 13, "camera_matriX");
  EXPECT_THAT(message(text), HasSubstr("rig.yml: camera 0: the field camera_matrix is missing"));
}

TEST(RigExchange, ColmapTextComesBackTheSame) {
  const Rig rig = TwoCameras(true);
  const auto text = FormatColmapText(rig);
  ASSERT_TRUE(text.ok()) << text.status();
  const auto back = ParseColmapText(text->cameras, text->images, "sparse");
  ASSERT_TRUE(back.ok()) << back.status();
  ExpectSame(*back, rig);
}

TEST(RigExchange, ColmapsPixelsStartAtTheCornerOfTheFirst) {
  const auto rig = ParseColmapText("1 SIMPLE_RADIAL 640 480 700 320.5 240.5 -0.1\n",
                                   "7 1 0 0 0 0 0 5 1 cam3.jpg\n10 20 -1 30 40 -1\n", "sparse");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras[0].cx_px, 320);
  EXPECT_EQ(rig->cameras[0].cy_px, 240);
  EXPECT_EQ(rig->cameras[0].fy_px, 700);
  EXPECT_EQ(rig->cameras[0].distortion[0], -0.1);
  EXPECT_EQ(rig->cameras[0].id, "cam3");
}

TEST(RigExchange, ColmapTextNamesFileAndLine) {
  const auto message = [](const std::string& cameras, const std::string& images) {
    const auto rig = ParseColmapText(cameras, images, "sparse");
    EXPECT_EQ(rig.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(rig.status().message());
  };
  EXPECT_THAT(message("# c\n1 THIN_PRISM_FISHEYE 640 480 1 2 3\n", ""),
              HasSubstr("sparse/cameras.txt: line 2: the model THIN_PRISM"));
  EXPECT_THAT(message("1 PINHOLE 640 480 700 700 320\n", ""),
              HasSubstr("sparse/cameras.txt: line 1: expected 4 numbers"));
  EXPECT_THAT(message("1 PINHOLE 640 480 700 700 320 240\n", "1 1 0 0 0 0 0 5 2 a.png\n"),
              HasSubstr("sparse/images.txt: line 1"));
}

}  // namespace
}  // namespace weft
