#include "animation/rays/view_poses.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/animation/recorded.h"

namespace weft {
namespace {

// Points within 100 mm, which places far away see.
class ViewPosesTest : public testing::Test {
 protected:
  ViewPosesTest() {
    root_ = Eigen::Translation3d(300, -200, 100) * Eigen::AngleAxisd(1.1, Eigen::Vector3d(2, 1, -2) / 3);
  }
  void See(int view, const Eigen::Vector3d& eye_mm, int count) {
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d point(100 * std::sin(1.3 * i), 70 * std::cos(2.1 * i),
                                  50 * std::sin(3.7 * i + 1));
      points_mm_.push_back(point);
      rays_.push_back({i, view, eye_mm, (root_ * point - eye_mm).normalized()});
    }
  }
  std::vector<Eigen::Isometry3d> Poses() const { return PosesFromViews(rays_, points_mm_, axis_); }

  Eigen::Isometry3d root_;
  Eigen::Vector3d axis_ = Eigen::Vector3d(1, 2, 2) / 3;
  std::vector<VertexRay> rays_;
  std::vector<Eigen::Vector3d> points_mm_;
};

TEST_F(ViewPosesTest, TheFirstIsWhereTheShapeStandsTheOthersAreTurned) {
  See(0, {2e5, 1e5, -3e5}, 40);
  const std::vector<Eigen::Isometry3d> poses = Poses();
  ASSERT_EQ(poses.size(), 8u);
  EXPECT_LT(Eigen::AngleAxisd(poses[0].linear().transpose() * root_.linear()).angle(), 2e-3);
  EXPECT_NEAR(poses[0].linear().determinant(), 1, 1e-9);
  // Across the view it is right to a fraction of a millimetre, along it to a thousandth of the way.
  const Eigen::Vector3d along = (root_.translation() - rays_[0].origin_mm).normalized(),
                        off = poses[0].translation() - root_.translation();
  EXPECT_LT((off - along * along.dot(off)).norm(), 2);
  EXPECT_LT(std::abs(along.dot(off)), 1e-3 * 4e5);
  for (int turn = 1; turn < 8; ++turn) {
    const Eigen::Matrix3d turned =
        poses[0].linear() * Eigen::AngleAxisd(turn * M_PI / 4, axis_).toRotationMatrix();
    EXPECT_LT((poses[static_cast<size_t>(turn)].linear() - turned).norm(), 1e-9);
    EXPECT_LT((poses[static_cast<size_t>(turn)].translation() - poses[0].translation()).norm(), 1e-9);
  }
}

// Nearby the pose is rougher, and still what a fit may begin with.
TEST_F(ViewPosesTest, NearbyItIsAGoodBeginning) {
  See(0, {1500, 300, -1200}, 60);
  EXPECT_LT(Eigen::AngleAxisd(Poses()[0].linear().transpose() * root_.linear()).angle(), 0.1);
  EXPECT_LT((Poses()[0].translation() - root_.translation()).norm(), 40);
}

TEST_F(ViewPosesTest, ViewsNeedTwentyRays) {
  See(1, {2e5, 1e5, -3e5}, 20);
  See(0, {-2e5, 1e5, 3e5}, 19);
  EXPECT_EQ(Poses().size(), 8u);
  See(2, {-2e5, -1e5, -3e5}, 20);
  const std::vector<Eigen::Isometry3d> poses = Poses();
  ASSERT_EQ(poses.size(), 16u);
  for (const size_t first : {0, 8})
    EXPECT_LT(Eigen::AngleAxisd(poses[first].linear().transpose() * root_.linear()).angle(), 2e-3);
  rays_.clear();
  EXPECT_TRUE(Poses().empty());
}

TEST(LongAxis, IsTheDirectionOfTheLargestSpread) {
  const Eigen::Vector3d far = Eigen::Vector3d(1, -2, 2) / 3, near = far.unitOrthogonal();
  const Eigen::Vector3d axis = LongAxis({100 * far, -90 * far, 30 * near, -30 * near, 10 * far.cross(near)});
  EXPECT_NEAR(std::abs(axis.dot(far)), 1, 1e-9);
  EXPECT_NEAR(axis.norm(), 1, 1e-12);
}

TEST(AcrossOf, GivesTwoDirectionsAcrossARay) {
  const Eigen::Vector3d direction = Eigen::Vector3d(2, -1, 2) / 3;
  Eigen::Vector3d a, b;
  AcrossOf(direction, &a, &b);
  EXPECT_NEAR(a.norm(), 1, 1e-12);
  EXPECT_NEAR(a.dot(direction), 0, 1e-12);
  EXPECT_LT((a.cross(b) - direction).norm(), 1e-12);
}

TEST_F(ViewPosesTest, StayAsTheyAre) {
  See(3, {900, 300, -700}, 60);
  See(1, {-800, 100, 900}, 25);
  Recorded recorded;
  recorded.Add("poses", Poses());
  recorded.Expect();
}

}  // namespace
}  // namespace weft
