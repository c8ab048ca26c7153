#include "capture/rig/kalibr_yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "capture/rig/opencv_yaml.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(KalibrYaml, AChainOfCamerasIsReadFromTheFirst) {
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

TEST(KalibrYaml, IsKnownByItsFirstCamera) {
  EXPECT_TRUE(IsKalibr(YAML::Load("cam0: {camera_model: pinhole, intrinsics: [1, 2, 3, 4]}")));
  EXPECT_FALSE(IsKalibr(YAML::Load("{image_width: 640}")));
}

// Each pose is that from the camera before, in metres.
TEST(KalibrYaml, PosesOfAChainAreMultiplied) {
  const std::string lens =
      "  resolution: [1280, 1024]\n  intrinsics: [700, 710, 640, 512]\n  camera_model: pinhole\n"
      "  distortion_model: none\n  distortion_coeffs: []\n";
  // Each camera 50 mm to the right of the one before, and turned by a quarter about its y.
  const std::string turn = "  T_cn_cnm1: [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.05], [0, 0, 0, 1]]\n";
  const auto rig =
      ReadKalibr(YAML::Load("cam0:\n" + lens + "cam1:\n" + turn + lens + "cam2:\n" + turn + lens));
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_THAT(rig->rig.cameras, SizeIs(3));
  // Of a quarter turn R and its shift (0, 0, 50): the centre is -R^T t = (50, 0, 0), seen from camera 0.
  EXPECT_LT((rig->rig.cameras[1].CenterWorld() - Eigen::Vector3d(50, 0, 0)).norm(), 1e-9);
  // Camera 2 lies at (50, 0, 0) of camera 1, so at R^T ((50, 0, 0) - t) = (50, 0, 50).
  EXPECT_LT((rig->rig.cameras[2].CenterWorld() - Eigen::Vector3d(50, 0, 50)).norm(), 1e-9);
  EXPECT_LT((rig->rig.cameras[2].rotation - Eigen::Matrix3d(Eigen::Vector3d(-1, 1, -1).asDiagonal())).norm(),
            1e-9);
}

}  // namespace
}  // namespace weft
