#include "services/figure/bvh_file.h"

#include <gtest/gtest.h>

#include "base/angles.h"

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

const std::string kSmall = R"(HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0.5 10 -0.25
    CHANNELS 3 Yrotation Xrotation Zrotation
    End Site
    {
      OFFSET 0 12 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
1 90 2 10 20 30 0 0 0
1 91 2 0 0 0 40 50 60
)";

std::string With(const std::string& what, const std::string& instead) {
  std::string out = kSmall;
  out.replace(out.find(what), what.size(), instead);
  return out;
}

TEST(BvhFile, ReadsHierarchyAndChannelsInTheirOrder) {
  const absl::StatusOr<ForeignMotion> motion = ParseBvh(kSmall, "a.bvh");
  ASSERT_TRUE(motion.ok()) << motion.status();
  EXPECT_NEAR(motion->fps, 50, 1e-3);
  ASSERT_EQ(motion->joints.size(), 3u);
  EXPECT_EQ(motion->joints[0].name, "Hips");
  EXPECT_EQ(motion->joints[1].name, "Spine");
  EXPECT_EQ(motion->joints[1].parent, 0);
  EXPECT_LT((motion->joints[1].offset - Vector3d(0.5, 10, -0.25)).norm(), 1e-6);
  EXPECT_LT((motion->joints[2].offset - Vector3d(0, 12, 0)).norm(), 1e-6);
  ASSERT_EQ(motion->poses.size(), 2u);
  EXPECT_LT((motion->poses[1].root - Vector3d(1, 91, 2)).norm(), 1e-5);
  const auto about = [](double degrees, const Vector3d& axis) {
    return AngleAxisd(kRadPerDeg * degrees, axis);
  };
  const Eigen::Quaterniond hips =
      about(10, Vector3d::UnitZ()) * about(20, Vector3d::UnitX()) * about(30, Vector3d::UnitY());
  const Eigen::Quaterniond spine =
      about(40, Vector3d::UnitY()) * about(50, Vector3d::UnitX()) * about(60, Vector3d::UnitZ());
  EXPECT_LT(motion->poses[0].rotation[0].angularDistance(hips), 1e-5);
  EXPECT_LT(motion->poses[1].rotation[1].angularDistance(spine), 1e-5);
}

TEST(BvhFile, SaysWhatIsWrongWithAFile) {
  const auto message = [](const std::string& bytes) {
    const absl::StatusOr<ForeignMotion> motion = ParseBvh(bytes, "a.bvh");
    EXPECT_EQ(motion.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(motion.status().message());
  };
  EXPECT_NE(message("solid cube").find("a.bvh: is not BVH"), std::string::npos);
  EXPECT_NE(message(kSmall.substr(0, kSmall.size() - 12)).find("a.bvh: is damaged: line"), std::string::npos);
  EXPECT_NE(message(With("Frames: 2", "Frames: 4000000000")).find("too short"), std::string::npos);
  EXPECT_NE(message(With("10 20 30", "10 x 30")).find("is damaged"), std::string::npos);
  EXPECT_NE(message(With("10 20 30", "10 nan 30")).find("number"), std::string::npos);
  EXPECT_NE(message(With("JOINT Spine", "JOINT Hips")).find("two joints are called \"Hips\""),
            std::string::npos);
  std::string deep = "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
  for (int k = 0; k < 100000; ++k)
    deep += "JOINT B" + std::to_string(k) + "\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
  EXPECT_NE(message(deep).find("more than 100 joints follow one another"), std::string::npos);
  EXPECT_EQ(ReadBvh("/nowhere/a.bvh").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
