// Cameras of YAML and JSON as other programs write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "capture/rig/opencv_yaml.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string YamlMatrix(const std::string& name, int rows, int cols, const std::string& data) {
  return name + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(cols) + "\n  data: [" +
         data + "]\n";
}

std::string YamlCamera(const std::string& rest) {
  return "image_width: 1280\nimage_height: 1024\n" +
         YamlMatrix("camera_matrix", 3, 3, "700., 0., 640., 0., 700., 512., 0., 0., 1.") + rest;
}

const std::string kFisheyeLens = YamlMatrix("distortion_coefficients", 4, 1, "0.08, -0.02, 0.006, -0.001");

std::vector<std::string> CameraIds(const absl::StatusOr<ForeignRig>& rig) {
  EXPECT_TRUE(rig.ok()) << rig.status();
  std::vector<std::string> ids;
  if (rig.ok())
    for (const CameraModel& camera : rig->rig.cameras) ids.push_back(camera.id);
  return ids;
}

std::string PosedCamera(const std::string& rest) {
  return YamlCamera(YamlMatrix("distortion_coefficients", 5, 1, "0, 0, 0, 0, 0") + rest);
}

TEST(YamlCameras, PosesAreReadByTheNamesThatProgramsGive) {
  // A quarter turn around y.
  const std::string turn = "[0, 0, 1, 0, 1, 0, -1, 0, 0]",
                    full = "[0,0,1,10, 0,1,0,20, -1,0,0,3000, 0,0,0,1]";
  const std::string inverse = "[[0,0,-1,3000], [0,1,0,-20], [1,0,0,-10]]";
  const std::vector<std::string> poses = {
      "R: " + turn + "\nT: [10, 20, 3000]\n",
      "rotation_matrix: " + turn + "\ntvec: [10, 20, 3000]\n",
      "rotation: [[0,0,1],[0,1,0],[-1,0,0]]\ntranslation: [[10],[20],[3000]]\n",
      std::string("rvec: [0, 1.5707963267948966, 0]\ntvec: [10, 20, 3000]\n"),
      "extrinsic_matrix: " + full + "\n",
      "extrinsics: {R: " + turn + ", T: [10, 20, 3000]}\n",
      YamlMatrix("camera_from_world", 3, 4, "0,0,1,10, 0,1,0,20, -1,0,0,3000"),
      "camera_to_world: " + inverse + "\n"};
  for (const std::string& pose : poses) {
    const auto rig = ParseOpenCvYaml(PosedCamera(pose), "cam.yml");
    ASSERT_TRUE(rig.ok()) << rig.status() << pose;
    const CameraModel& camera = rig->rig.cameras[0];
    EXPECT_LT((camera.translation_mm - Eigen::Vector3d(10, 20, 3000)).norm(), 1e-9) << pose;
    EXPECT_LT((camera.rotation.row(0) - Eigen::RowVector3d(0, 0, 1)).norm(), 1e-9) << pose;
  }
}

TEST(YamlCameras, PosesThatAreNotReadAreRefused) {
  const auto message = [](const std::string& pose) {
    const auto rig = ParseOpenCvYaml(PosedCamera(pose), "cam.yml");
    EXPECT_EQ(rig.status().code(), absl::StatusCode::kInvalidArgument) << pose;
    return std::string(rig.status().message());
  };
  const std::string identity = "[1,0,0,0,1,0,0,0,1]";
  EXPECT_THAT(message("R: " + identity + "\n"), HasSubstr("the field T is missing beside R"));
  EXPECT_THAT(message("tvec: [1, 2, 3]\n"), HasSubstr("the field R is missing beside tvec"));
  EXPECT_THAT(message("pose: [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]\n"), HasSubstr("the field pose seems"));
  EXPECT_THAT(message("quaternion: [1, 0, 0, 0]\nposition: [1, 2, 3]\n"), HasSubstr("write R (3x3) and T"));
  EXPECT_THAT(message("extrinsics: {q: [1,0,0,0]}\n"), HasSubstr("the field extrinsics seems"));
  EXPECT_THAT(message("extrinsic_matrix: [1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1]\n"),
              HasSubstr("is it transposed?"));
  EXPECT_THAT(message("extrinsic_matrix: " + identity + "\n"),
              HasSubstr("has 9 numbers, expected 3x4 or 4x4"));
  EXPECT_THAT(message("rotation: [0, 90, 0]\ntranslation: [1, 2, 3]\n"), HasSubstr("which may be angles"));
  EXPECT_THAT(message("w2c: [1,0,0,0,0,1,0,0,0,0,1,0]\nc2w: [1,0,0,0,0,1,0,0,0,0,1,0]\n"),
              HasSubstr("are two poses"));
  // The poses of the board are none of the camera.
  EXPECT_TRUE(
      ParseOpenCvYaml(PosedCamera(YamlMatrix("extrinsic_parameters", 2, 6, "0,0,0,0,0,9,0,0,0,0,0,9")), "c")
          .ok());
  EXPECT_TRUE(ParseOpenCvYaml(PosedCamera("rotation: 90\n"), "cam.yml").ok());  // of the picture
  const auto stereo = ParseOpenCvYaml(
      PosedCamera(
          "R: [0.9998, 0, 0.02, 0, 1, 0, -0.02, 0, 0.9998]\nP: [700,0,640,-70, 0,700,512,0, 0,0,1,0]\n"),
      "ros");
  ASSERT_TRUE(stereo.ok()) << stereo.status();
  EXPECT_THAT(stereo->remarks, ElementsAre(HasSubstr("the camera is at the world's origin")));
}

TEST(YamlCameras, CamerasAreCalledAsTheirFilesCallThem) {
  EXPECT_THAT(CameraIds(ParseOpenCvYaml(PosedCamera("name: left\n"), "cam.yml")), ElementsAre("left"));
  EXPECT_THAT(CameraIds(ParseOpenCvYaml(PosedCamera("camera_id: 7\n"), "cam.yml")), ElementsAre("7"));
  const std::string lens =
      "{image_width: 1280, image_height: 1024, K: [700,0,640,0,700,512,0,0,1], D: [0,0,0,0,0]}";
  EXPECT_THAT(CameraIds(ParseOpenCvYaml("left: " + lens + "\nright: " + lens + "\n", "m")),
              ElementsAre("left", "right"));
  EXPECT_THAT(CameraIds(ParseOpenCvYaml("cameras: {a: " + lens + ", b: " + lens + "}\n", "m")),
              ElementsAre("a", "b"));
  const auto unnamed = ParseOpenCvYaml("[" + lens + ", " + lens + "]\n", "list");
  EXPECT_THAT(CameraIds(unnamed), ElementsAre("camera0", "camera1"));
  EXPECT_THAT(unnamed->remarks, ElementsAre(HasSubstr("camera 0 has no camera_name"), HasSubstr("camera 1")));
}

TEST(YamlCameras, AFieldMayNameTheLensAnywhere) {
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
  const auto fisheye = ParseOpenCvYaml(YamlCamera(kFisheyeLens + "camera_model: fisheye\n"), "cam.yml");
  ASSERT_TRUE(fisheye.ok()) << fisheye.status();
  EXPECT_NEAR(fisheye->rig.cameras[0].Project({1, 0, 1})->x(), 640 + 700 * 0.8191714, 0.01);
}

}  // namespace
}  // namespace weft
