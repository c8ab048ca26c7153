// The kernels against the plain path.
#include <gtest/gtest.h>

#include "tests/triangulation/plain_triangulation.h"
#include "tests/triangulation/synthetic_views.h"
#include "triangulation/triangulate.h"

namespace weft {
namespace {

using testing::BentSheet;
using testing::Observe;
using testing::PlainPoint;
using testing::PlainTriangulate;
using testing::RingRig;
using testing::Spoil;

void ExpectSameResult(int cameras, double wrong_share, double sigma_px) {
  const Rig rig = RingRig(cameras);
  std::vector<ViewObservations> views = Observe(rig, BentSheet(30, 30), sigma_px, 3);
  Spoil(wrong_share, &views);
  TriangulationOptions options;
  options.two_view.accept = false;
  const std::map<BoardNode, PlainPoint> plain = PlainTriangulate(rig, views, options);
  const auto cloud = Triangulate(rig, views, options);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_GT(plain.size(), 500u);
  // Of the plain points those without geometry, which fall to the gates.
  EXPECT_LE(cloud->points.size(), plain.size());
  EXPECT_GE(cloud->points.size() + 3, plain.size());
  int others = 0;
  for (const CloudPoint& point : cloud->points) {
    const auto same = plain.find(point.node);
    ASSERT_NE(same, plain.end());
    // Some nodes have two sets of rays that are the inliers of the point that they make.
    others += point.views != same->second.views ? 1 : 0;
    if (point.views != same->second.views) continue;
    EXPECT_LT((point.position_mm - same->second.point.position_mm).norm(), 0.015 * point.sigma_mm);
    // One factor is common to all entries: the frame's, by how the node's residuals scatter against it.
    const Eigen::Matrix3d &a = point.covariance_mm2, &b = same->second.point.covariance_mm2;
    EXPECT_LT((a / a.trace() - b / b.trace()).norm(), 1e-3);
    EXPECT_GE(a.trace() / b.trace(), 0.4);
  }
  EXPECT_LE(others, 1);
}

TEST(PlainPath, SameResultWithFewCamerasAndAllPairs) { ExpectSameResult(9, 0.15, 0.1); }
TEST(PlainPath, SameResultWithManyCamerasAndDrawnPairs) { ExpectSameResult(40, 0.2, 0.15); }
TEST(PlainPath, SameResultWhereHalfIsWrong) { ExpectSameResult(25, 0.5, 0.2); }

TEST(PlainPath, SameResultBehindAFisheyeLens) {
  // Distortion so strong that Newton's method in the kernel gives some pixels up.
  Rig rig = RingRig(12);
  for (CameraModel& camera : rig.cameras) {
    camera.fx_px = camera.fy_px = 900;
    camera.translation_mm.z() -= 2100;
    camera.distortion = {-0.3, 0.12, 0, 0, -0.02, 0.05, 0.01, 0};
  }
  const std::vector<ViewObservations> views = Observe(rig, BentSheet(20, 20), 0.1, 4);
  const std::map<BoardNode, PlainPoint> plain = PlainTriangulate(rig, views, {});
  const auto cloud = Triangulate(rig, views, {});
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_GT(cloud->points.size(), 300u);
  for (const CloudPoint& point : cloud->points) {
    if (point.views < 3) continue;
    EXPECT_LT((point.position_mm - plain.at(point.node).point.position_mm).norm(), 1e-3);
  }
}

}  // namespace
}  // namespace weft
