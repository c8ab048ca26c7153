#include "triangulation/rejected_rays.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/triangulation/synthetic_views.h"

namespace weft {
namespace {

// A sheet of which columns 10 and on are seen by one camera, or by two beside each other, alone.
class RejectedRays : public ::testing::Test {
 protected:
  static constexpr double kSigmaPx = 0.15;

  RejectedRays() {
    views_ = testing::Observe(rig_, truth_, kSigmaPx, 5);
    for (ViewObservations& view : views_) {
      std::erase_if(view.observations, [&](const Observation& o) {
        return o.node.col >= 10 && view.camera != 2 && !(o.node.col >= 15 && view.camera == 3);
      });
    }
    TriangulationOptions options;
    options.two_view.accept = false;
    cloud_ = *Triangulate(rig_, views_, options);
    rays_ = RaysOfRejected(rig_, views_, cloud_, options.refinement);
  }

  const Rig rig_ = testing::RingRig(24);
  const std::vector<testing::NodeTruth> truth_ = testing::BentSheet(20, 20);
  std::vector<ViewObservations> views_;
  Cloud cloud_;
  std::vector<CloudRay> rays_;
};

TEST_F(RejectedRays, EachSightOfANodeWithoutAPointIsARay) {
  EXPECT_EQ(cloud_.points.size(), 200u);
  EXPECT_EQ(rays_.size(), 20u * (5 + 2 * 5));
  std::map<BoardNode, int> count;
  for (const CloudRay& ray : rays_) ++count[ray.node];
  for (const auto& [node, rays] : count) {
    EXPECT_GE(node.col, 10);
    EXPECT_EQ(rays, node.col < 15 ? 1 : 2);
  }
  EXPECT_TRUE(std::is_sorted(rays_.begin(), rays_.end(),
                             [](const CloudRay& a, const CloudRay& b) { return a.node < b.node; }));
}

TEST_F(RejectedRays, RaysPassTheTrueNodesByTheirSigma) {
  std::map<BoardNode, Eigen::Vector3d> position_mm;
  for (const testing::NodeTruth& node : truth_) position_mm[node.node] = node.position_mm;
  double squared_sigmas = 0;
  for (const CloudRay& ray : rays_) {
    EXPECT_NEAR(ray.direction.norm(), 1, 1e-12);
    const Eigen::Vector3d way_mm = position_mm[ray.node] - ray.origin_mm;
    EXPECT_GT(ray.direction.dot(way_mm), 0);
    const double off_mm = (way_mm - ray.direction.dot(way_mm) * ray.direction).norm();
    squared_sigmas += std::pow(off_mm / (ray.sigma_rad * way_mm.norm()), 2);
  }
  // Two axes each. The sigma also holds what the calibration leaves, which is no error here.
  const double of_noise = kSigmaPx * kSigmaPx;
  const double calibration_px = RefinementOptions().calibration_sigma_px;
  const double expected = 2 * of_noise / (of_noise + calibration_px * calibration_px);
  EXPECT_NEAR(squared_sigmas / static_cast<double>(rays_.size()), expected, 0.15 * expected);
}

TEST_F(RejectedRays, WhatHasAPointHasNoRays) {
  const std::vector<ViewObservations> all = testing::Observe(rig_, truth_, kSigmaPx, 5);
  const Cloud cloud = *Triangulate(rig_, all, {});
  ASSERT_EQ(cloud.points.size(), truth_.size());
  EXPECT_TRUE(RaysOfRejected(rig_, all, cloud, {}).empty());
}

}  // namespace
}  // namespace weft
