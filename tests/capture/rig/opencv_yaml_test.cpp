#include "capture/rig/opencv_yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "tests/capture/rig/exchanged_rig.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(OpenCvYaml, KeepsEveryDigit) {
  for (const bool rational : {false, true}) {
    const Rig rig = TwoCameras(rational);
    const auto text = FormatOpenCvYaml(rig);
    ASSERT_TRUE(text.ok()) << text.status();
    const auto back = ParseOpenCvYaml(*text, "rig.yml");
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(back->rig.ContentHash(), rig.ContentHash());
    EXPECT_THAT(back->remarks, IsEmpty());
  }
}

TEST(OpenCvYaml, ReadsTheFileOfOpenCvsCalibrationOfOneCamera) {
  cv::FileStorage file(".yml",
                       cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  file << "image_width" << 640 << "image_height" << 480;
  file << "camera_matrix" << cv::Mat((cv::Mat_<double>(3, 3) << 700, 0, 320, 0, 710, 240, 0, 0, 1));
  file << "distortion_coefficients" << cv::Mat((cv::Mat_<double>(5, 1) << -0.2, 0.1, 0, 0, 0.01));
  const auto rig = ParseOpenCvYaml(file.releaseAndGetString(), "one.yml");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->rig.cameras.size(), 1u);
  EXPECT_EQ(rig->rig.cameras[0].id, "camera0");
  EXPECT_EQ(rig->rig.cameras[0].fy_px, 710);
  EXPECT_EQ(rig->rig.cameras[0].distortion[4], 0.01);
}

TEST(OpenCvYaml, NamesWhatIsMissing) {
  const auto message = [](const std::string& text) {
    return std::string(ParseOpenCvYaml(text, "rig.yml").status().message());
  };
  EXPECT_THAT(message("%YAML:1.0\n---\nimage_width: 640\n"), HasSubstr("image_height"));
  EXPECT_THAT(message("no yaml at all"), HasSubstr("rig.yml"));
  std::string text = FormatOpenCvYaml(TwoCameras(false)).value();
  text.replace(text.find("camera_matrix"), 13, "camera_matrice");
  EXPECT_THAT(message(text), HasSubstr("rig.yml: camera 0: the field camera_matrix is missing"));
}

TEST(OpenCvYaml, CamerasAreCalledAsTheirFilesCallThem) {
  EXPECT_THAT(IdsOf(ParseOpenCvYaml(PosedCamera("name: left\n"), "cam.yml")), ElementsAre("left"));
  EXPECT_THAT(IdsOf(ParseOpenCvYaml(PosedCamera("camera_id: 7\n"), "cam.yml")), ElementsAre("7"));
  const std::string lens =
      "{image_width: 1280, image_height: 1024, K: [700,0,640,0,700,512,0,0,1], D: [0,0,0,0,0]}";
  EXPECT_THAT(IdsOf(ParseOpenCvYaml("left: " + lens + "\nright: " + lens + "\n", "m")),
              ElementsAre("left", "right"));
  EXPECT_THAT(IdsOf(ParseOpenCvYaml("cameras: {a: " + lens + ", b: " + lens + "}\n", "m")),
              ElementsAre("a", "b"));
  const auto unnamed = ParseOpenCvYaml("[" + lens + ", " + lens + "]\n", "list");
  EXPECT_THAT(IdsOf(unnamed), ElementsAre("camera0", "camera1"));
  EXPECT_THAT(unnamed->remarks, ElementsAre(HasSubstr("camera 0 has no camera_name"), HasSubstr("camera 1")));
}

TEST(OpenCvYaml, ReadsCameraInfoOfRos) {
  const auto calibrated = ParseOpenCvYaml(
      YamlCamera("camera_name: 0021\ndistortion_model: plumb_bob\n" +
                 YamlMatrix("distortion_coefficients", 1, 5, "-0.11, 0.09, 0.0004, -0.0002, 0.0") +
                 YamlMatrix("rectification_matrix", 3, 3, "1, 0, 0, 0, 1, 0, 0, 0, 1") +
                 YamlMatrix("projection_matrix", 3, 4, "700, 0, 640, 0, 0, 700, 512, 0, 0, 0, 1, 0")),
      "left.yaml");
  ASSERT_TRUE(calibrated.ok()) << calibrated.status();
  EXPECT_EQ(calibrated->rig.cameras[0].id, "0021");
  EXPECT_EQ(calibrated->rig.cameras[0].distortion[3], -0.0002);
  const auto echoed = ParseOpenCvYaml(
      "header:\n  frame_id: left\nheight: 1024\nwidth: 1280\ndistortion_model: rational_polynomial\n"
      "d: [-0.1, 0.2, 0, 0, 0, 0.1, 0.2, 0.3]\nk: [700, 0, 640, 0, 700, 512, 0, 0, 1]\n"
      "r: [0, 0, 0, 0, 0, 0, 0, 0, 0]\np: [700, 0, 640, 0, 0, 700, 512, 0, 0, 0, 1, 0]\n---\n",
      "left.yaml");
  ASSERT_TRUE(echoed.ok()) << echoed.status();
  EXPECT_EQ(echoed->rig.cameras[0].distortion[7], 0.3);
  EXPECT_TRUE(echoed->rig.cameras[0].rotation.isIdentity());
}

TEST(OpenCvYaml, ReadsJsonOfOpenCvAndNamesTheRemedyForItsXml) {
  const Rig rig = TwoCameras(true);
  cv::FileStorage file(".json",
                       cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_JSON);
  file << "cameras"
       << "[";
  for (const CameraModel& c : rig.cameras) {
    cv::Mat r(3, 3, CV_64F), t(3, 1, CV_64F), d(1, 8, CV_64F);
    for (int i = 0; i < 9; ++i) r.at<double>(i / 3, i % 3) = c.rotation(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) t.at<double>(i) = c.translation_mm[i];
    for (int i = 0; i < 8; ++i) d.at<double>(i) = c.distortion[i];
    file << "{"
         << "camera_name" << c.id << "image_width" << c.width_px << "image_height" << c.height_px
         << "camera_matrix"
         << cv::Mat((cv::Mat_<double>(3, 3) << c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1))
         << "distortion_coefficients" << d << "R" << r << "T" << t << "}";
  }
  file << "]";
  const auto back = ParseOpenCvYaml(file.releaseAndGetString(), "rig.json");
  ASSERT_TRUE(back.ok()) << back.status();
  ExpectSame(back->rig, rig);
  EXPECT_THAT(
      std::string(
          ParseOpenCvYaml("<?xml version=\"1.0\"?>\n<opencv_storage/>\n", "rig.xml").status().message()),
      HasSubstr("rig.xml: is XML; write it as YAML"));
}

TEST(OpenCvYaml, AliasesOfYamlDoNotFillTheMemory) {
  std::string text = "image_width: 10\nimage_height: 10\na: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  char last = 'a';
  for (char name = 'b'; name < 'n'; last = name++) {
    text += std::string(1, name) + ": &" + name + " [";
    for (int i = 0; i < 10; ++i) text += std::string(i ? ", *" : "*") + last;
    text += "]\n";
  }
  text += "camera_matrix: *m\n";
  EXPECT_THAT(std::string(ParseOpenCvYaml(text, "laughs.yml").status().message()),
              HasSubstr("more numbers than a camera"));
}

}  // namespace
}  // namespace weft
