#include "capture/rig/yaml_lens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "capture/rig/opencv_yaml.h"
#include "tests/capture/rig/exchanged_rig.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kFisheye = YamlMatrix("distortion_coefficients", 4, 1, "0.08, -0.02, 0.006, -0.001");

TEST(YamlLens, ModelsOfOpenCvAndRosAreFollowed) {
  for (const char* model :
       {"fisheye_model: 1\n", "distortion_model: equidistant\n", "distortion_model: \"fisheye\"\n"}) {
    const auto rig = ParseOpenCvYaml(YamlCamera(kFisheye + model), "cam.yml");
    ASSERT_TRUE(rig.ok()) << rig.status();
    EXPECT_NEAR(rig->rig.cameras[0].Project({1, 0, 1})->x(), 640 + 700 * 0.8191714, 0.01) << model;
    EXPECT_THAT(rig->remarks, ElementsAre(HasSubstr("camera camera0: its fisheye lens is held to")));
  }
  const auto plain = ParseOpenCvYaml(YamlCamera(kFisheye + "fisheye_model: 0\n"), "cam.yml");
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->rig.cameras[0].distortion[0], 0.08);
  EXPECT_THAT(plain->remarks, IsEmpty());
  const auto unnamed = ParseOpenCvYaml(YamlCamera(kFisheye), "cam.yml");
  ASSERT_TRUE(unnamed.ok());
  EXPECT_THAT(unnamed->remarks, ElementsAre(HasSubstr("distortion_model: fisheye")));
  const auto message = [](const std::string& rest) {
    return std::string(ParseOpenCvYaml(YamlCamera(rest), "cam.yml").status().message());
  };
  EXPECT_THAT(message(kFisheye + "distortion_model: double_sphere\n"),
              HasSubstr("the lens model double_sphere"));
  EXPECT_THAT(message(kFisheye + "xi: 1.2\n"), HasSubstr("omnidirectional"));
  EXPECT_THAT(message(YamlMatrix("distortion_coefficients", 1, 5, "0, 0, 0, 0")),
              HasSubstr("its rows and cols make 5"));
  EXPECT_THAT(message(YamlMatrix("distortion_coefficients", 1, 5, "0, 0, x, 0, 0")),
              HasSubstr("\"x\" is no number"));
  EXPECT_THAT(message(YamlMatrix("distortion_coefficients", 1, 12, "0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0")),
              HasSubstr("thin prism"));
  EXPECT_EQ(message(YamlMatrix("distortion_coefficients", 1, 14, "0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0")),
            "");
}

TEST(YamlLens, AFieldMayNameTheLensAnywhere) {
  const std::string five = YamlMatrix("distortion_coefficients", 5, 1, "0.08, -0.02, 0, 0, 0");
  const auto message = [](const std::string& text) {
    return std::string(ParseOpenCvYaml(text, "cam.yml").status().message());
  };
  EXPECT_THAT(message(YamlCamera(five + "camera_model: fisheye\n")),
              HasSubstr("the model fisheye has 4 distortion coefficients, the file 5"));
  EXPECT_THAT(message(YamlCamera(five + "distortion_model: plumb_bob\ncamera_model: fisheye\n")),
              HasSubstr("which are other lenses"));
  EXPECT_THAT(message(YamlCamera(five + "camera_model: omni\n")), HasSubstr("the lens model omni"));
  EXPECT_EQ(message(YamlCamera(five + "camera_model: Blackfly S\n")), "");
  EXPECT_EQ(message(YamlCamera(five + "camera_model: pinhole\ndistortion_model: radtan\n")), "");
  const auto fisheye = ParseOpenCvYaml(YamlCamera(kFisheye + "camera_model: fisheye\n"), "cam.yml");
  ASSERT_TRUE(fisheye.ok()) << fisheye.status();
  EXPECT_NEAR(fisheye->rig.cameras[0].Project({1, 0, 1})->x(), 640 + 700 * 0.8191714, 0.01);
}

TEST(YamlLens, EachModelHasItsNumberOfCoefficients) {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = 1280, camera.height_px = 1024;
  camera.fx_px = camera.fy_px = 700, camera.cx_px = 640, camera.cy_px = 512;
  std::vector<std::string> remarks;
  const auto message = [&](const std::string& model, const std::vector<double>& coefficients) {
    return std::string(SetYamlLens(model, coefficients, camera, remarks).message());
  };
  EXPECT_EQ(message("none", {}), "");
  EXPECT_THAT(message("none", {0.1}), HasSubstr("the model none has 0 distortion coefficients, the file 1"));
  EXPECT_THAT(message("fov", {0.5, 0.5}),
              HasSubstr("the model fov has 1 distortion coefficients, the file 2"));
  EXPECT_THAT(message("equidistant", {0.1, 0, 0}), HasSubstr("the four of the fisheye calibration"));
  EXPECT_THAT(message("mei", {0.1}), HasSubstr("the lens model mei has no counterpart here"));
  EXPECT_THAT(remarks, IsEmpty());
  EXPECT_EQ(message("Rational_Polynomial", {-0.1, 0.2, 0.001, 0.002, 0.05, 0.3, 0.4, 0.5}), "");
  EXPECT_THAT(camera.distortion, ElementsAre(-0.1, 0.2, 0.001, 0.002, 0.05, 0.3, 0.4, 0.5));
  EXPECT_EQ(message("fov", {0.5}), "");
  EXPECT_THAT(remarks, ElementsAre(HasSubstr("camera c: its fisheye lens is held to")));
}

}  // namespace
}  // namespace weft
