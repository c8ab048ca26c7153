#include "services/results/export/export_transform.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

namespace weft {
namespace {

Eigen::Vector3d AxisOf(const std::string& name) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  axis[name.back() - 'x'] = name.front() == '-' ? -1 : 1;
  return axis;
}

TEST(ExportTransformTest, TurnsTheWorldsUpToTheFilesUpWithoutMirroring) {
  for (const std::string world_up : {"x", "-x", "y", "-y", "z", "-z"}) {
    for (const UpAxis up : {UpAxis::kY, UpAxis::kZ}) {
      const auto transform = ExportTransform::Make(up, world_up, LengthUnit::kMillimetre);
      ASSERT_TRUE(transform.ok());
      const Eigen::Vector3d expected = up == UpAxis::kY ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
      EXPECT_EQ(transform->rotation * AxisOf(world_up), expected) << world_up;
      EXPECT_EQ(transform->rotation.determinant(), 1) << world_up;
    }
  }
}

TEST(ExportTransformTest, ScalesToTheUnit) {
  const Eigen::Vector3d world_mm(1000, 2000, -3000);
  const auto metres = ExportTransform::Make(UpAxis::kY, "-y", LengthUnit::kMetre);
  const auto centimetres = ExportTransform::Make(UpAxis::kZ, "-y", LengthUnit::kCentimetre);
  EXPECT_EQ(metres->Position(world_mm), Eigen::Vector3f(1, -2, 3));
  EXPECT_EQ(centimetres->Position(world_mm), Eigen::Vector3f(100, -300, -200));
}

TEST(ExportTransformTest, RefusesOtherAxes) {
  EXPECT_THAT(ExportTransform::Make(UpAxis::kY, "up", LengthUnit::kMetre).status().message(),
              ::testing::HasSubstr("--world-up"));
}

}  // namespace
}  // namespace weft
