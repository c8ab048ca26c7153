#include "capture/rig/yaml_pose.h"

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

TEST(YamlPose, IsReadByTheNamesThatProgramsGive) {
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

TEST(YamlPose, ThatIsNotReadIsRefused) {
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

TEST(YamlPose, ACameraWithoutOneStaysWhereItIs) {
  CameraModel camera;
  camera.translation_mm = {1, 2, 3};
  std::vector<std::string> remarks;
  ASSERT_TRUE(SetYamlPose(YAML::Load("{image_width: 640}"), camera, remarks).ok());
  EXPECT_EQ(camera.translation_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(camera.rotation.isIdentity());
  EXPECT_TRUE(remarks.empty());
}

TEST(YamlPose, AVectorOfRodriguesOfNoLengthTurnsNothing) {
  CameraModel camera;
  std::vector<std::string> remarks;
  ASSERT_TRUE(SetYamlPose(YAML::Load("{rvec: [0, 0, 0], tvec: [4, 5, 6]}"), camera, remarks).ok());
  EXPECT_TRUE(camera.rotation.isIdentity());
  EXPECT_EQ(camera.translation_mm, Eigen::Vector3d(4, 5, 6));
}

}  // namespace
}  // namespace weft
