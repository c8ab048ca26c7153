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

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

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
    EXPECT_EQ(back->rig.ContentHash(), rig.ContentHash());
    EXPECT_THAT(back->remarks, IsEmpty());
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
  ASSERT_EQ(rig->rig.cameras.size(), 1u);
  EXPECT_EQ(rig->rig.cameras[0].id, "camera0");
  EXPECT_EQ(rig->rig.cameras[0].fy_px, 710);
  EXPECT_EQ(rig->rig.cameras[0].distortion[4], 0.01);
}

TEST(RigExchange, OpenCvYamlNamesWhatIsMissing) {
  const auto message = [](const std::string& text) {
    return std::string(ParseOpenCvYaml(text, "rig.yml").status().message());
  };
  EXPECT_THAT(message("%YAML:1.0\n---\nimage_width: 640\n"), HasSubstr("image_height"));
  EXPECT_THAT(message("no yaml at all"), HasSubstr("rig.yml"));
  std::string text = FormatOpenCvYaml(TwoCameras(false)).value();
  text.replace(text.find("camera_matrix"), 13, "camera_matrice");
  EXPECT_THAT(message(text), HasSubstr("rig.yml: camera 0: the field camera_matrix is missing"));
}

TEST(RigExchange, ColmapTextComesBackTheSame) {
  const Rig rig = TwoCameras(true);
  const auto text = FormatColmapText(rig);
  ASSERT_TRUE(text.ok()) << text.status();
  const auto back = ParseColmapText(text->cameras, text->images, "sparse");
  ASSERT_TRUE(back.ok()) << back.status();
  ExpectSame(back->rig, rig);
}

TEST(RigExchange, ColmapsPixelsStartAtTheCornerOfTheFirst) {
  const auto rig = ParseColmapText("1 SIMPLE_RADIAL 640 480 700 320.5 240.5 -0.1\n",
                                   "7 1 0 0 0 0 0 5 1 cam3.jpg\n10 20 -1 30 40 -1\n", "sparse");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->rig.cameras[0].cx_px, 320);
  EXPECT_EQ(rig->rig.cameras[0].cy_px, 240);
  EXPECT_EQ(rig->rig.cameras[0].fy_px, 700);
  EXPECT_EQ(rig->rig.cameras[0].distortion[0], -0.1);
  EXPECT_EQ(rig->rig.cameras[0].id, "cam3");
}

TEST(RigExchange, ColmapTextNamesFileAndLine) {
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

constexpr char kFourLenses[] =
    "1 PINHOLE 600 800 4000 4000 300 400\n2 PINHOLE 600 800 4000 4000 300 400\n"
    "3 PINHOLE 600 800 4000 4000 300 400\n4 PINHOLE 600 800 4000 4000 300 400\n";

std::vector<std::string> IdsOf(const absl::StatusOr<ForeignRig>& rig) {
  EXPECT_TRUE(rig.ok()) << rig.status();
  std::vector<std::string> ids;
  if (rig.ok())
    for (const CameraModel& camera : rig->rig.cameras) ids.push_back(camera.id);
  return ids;
}

TEST(RigExchange, ColmapsLineOfPointsMayBeMissing) {
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

TEST(RigExchange, ColmapsPathsNameTheCamera) {
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

TEST(RigExchange, ColmapLensesAreReadOrNamed) {
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

std::string Matrix(const std::string& name, int rows, int cols, const std::string& data) {
  return name + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(cols) + "\n  data: [" +
         data + "]\n";
}
std::string CameraText(const std::string& rest) {
  return "image_width: 1280\nimage_height: 1024\n" +
         Matrix("camera_matrix", 3, 3, "700., 0., 640., 0., 700., 512., 0., 0., 1.") + rest;
}
const std::string kFisheye = Matrix("distortion_coefficients", 4, 1, "0.08, -0.02, 0.006, -0.001");

TEST(RigExchange, LensModelsOfOpenCvAndRosAreFollowed) {
  for (const char* model :
       {"fisheye_model: 1\n", "distortion_model: equidistant\n", "distortion_model: \"fisheye\"\n"}) {
    const auto rig = ParseOpenCvYaml(CameraText(kFisheye + model), "cam.yml");
    ASSERT_TRUE(rig.ok()) << rig.status();
    EXPECT_NEAR(rig->rig.cameras[0].Project({1, 0, 1})->x(), 640 + 700 * 0.8191714, 0.01) << model;
    EXPECT_THAT(rig->remarks, ElementsAre(HasSubstr("camera camera0: its fisheye lens is held to")));
  }
  const auto plain = ParseOpenCvYaml(CameraText(kFisheye + "fisheye_model: 0\n"), "cam.yml");
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->rig.cameras[0].distortion[0], 0.08);
  EXPECT_THAT(plain->remarks, IsEmpty());
  const auto unnamed = ParseOpenCvYaml(CameraText(kFisheye), "cam.yml");
  ASSERT_TRUE(unnamed.ok());
  EXPECT_THAT(unnamed->remarks, ElementsAre(HasSubstr("distortion_model: fisheye")));
  const auto message = [](const std::string& rest) {
    return std::string(ParseOpenCvYaml(CameraText(rest), "cam.yml").status().message());
  };
  EXPECT_THAT(message(kFisheye + "distortion_model: double_sphere\n"),
              HasSubstr("the lens model double_sphere"));
  EXPECT_THAT(message(kFisheye + "xi: 1.2\n"), HasSubstr("omnidirectional"));
  EXPECT_THAT(message(Matrix("distortion_coefficients", 1, 5, "0, 0, 0, 0")),
              HasSubstr("its rows and cols make 5"));
  EXPECT_THAT(message(Matrix("distortion_coefficients", 1, 5, "0, 0, x, 0, 0")),
              HasSubstr("\"x\" is no number"));
  EXPECT_THAT(message(Matrix("distortion_coefficients", 1, 12, "0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0")),
              HasSubstr("thin prism"));
  EXPECT_EQ(message(Matrix("distortion_coefficients", 1, 14, "0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0")),
            "");
}

TEST(RigExchange, ReadsCameraInfoOfRos) {
  const auto calibrated = ParseOpenCvYaml(
      CameraText("camera_name: 0021\ndistortion_model: plumb_bob\n" +
                 Matrix("distortion_coefficients", 1, 5, "-0.11, 0.09, 0.0004, -0.0002, 0.0") +
                 Matrix("rectification_matrix", 3, 3, "1, 0, 0, 0, 1, 0, 0, 0, 1") +
                 Matrix("projection_matrix", 3, 4, "700, 0, 640, 0, 0, 700, 512, 0, 0, 0, 1, 0")),
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

TEST(RigExchange, ReadsJsonOfOpenCvAndNamesTheRemedyForItsXml) {
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

TEST(RigExchange, ReadsTheChainOfKalibr) {
  // cam1 is 100 mm to the right of cam0 and turned by a quarter about z.
  const std::string lens =
      "  resolution: [1280, 1024]\n  intrinsics: [700, 710, 640, 512]\n  camera_model: pinhole\n";
  const std::string text =
      "cam0:\n  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.2, 0.001, 0.002]\n" + lens +
      "cam1:\n  distortion_model: equidistant\n  distortion_coeffs: [0.08, -0.02, 0.006, -0.001]\n" +
      "  T_cn_cnm1:\n  - [0, 1, 0, 0]\n  - [-1, 0, 0, 0.1]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n" + lens;
  const auto rig = ParseOpenCvYaml(text, "camchain.yaml");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_THAT(rig->rig.cameras, SizeIs(2));
  EXPECT_EQ(rig->rig.cameras[0].distortion[1], 0.2);
  EXPECT_EQ(rig->rig.cameras[0].fy_px, 710);
  EXPECT_LT((rig->rig.cameras[1].CenterWorld() - Eigen::Vector3d(100, 0, 0)).norm(), 1e-9);
  std::string omni = text;
  omni.replace(omni.find("pinhole"), 7, "omni");
  EXPECT_THAT(std::string(ParseOpenCvYaml(omni, "camchain.yaml").status().message()),
              HasSubstr("cam0: the camera model omni"));
  std::string gap = text;
  gap.replace(gap.find("cam1"), 4, "cam2");
  EXPECT_THAT(std::string(ParseOpenCvYaml(gap, "camchain.yaml").status().message()),
              HasSubstr("holds cam2 and no cam1"));
  EXPECT_THAT(std::string(ParseOpenCvYaml(text + "---\n" + text, "two.yaml").status().message()),
              HasSubstr("holds 2 YAML documents"));
  EXPECT_TRUE(ParseOpenCvYaml("---\n" + text + "---\n", "one.yaml").ok());
}

TEST(RigExchange, AliasesOfYamlDoNotFillTheMemory) {
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
