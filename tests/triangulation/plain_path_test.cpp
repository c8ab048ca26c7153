// The kernels against the plain path, and against each other.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/triangulation/plain_triangulation.h"
#include "tests/triangulation/synthetic_views.h"
#include "triangulation/ray_groups.h"
#include "triangulation/ray_kernel.h"
#include "triangulation/triangulate.h"

namespace weft {
namespace {

using testing::BentSheet;
using testing::NodeTruth;
using testing::Observe;
using testing::PlainPoint;
using testing::PlainTriangulate;
using testing::RingRig;

// A share of the observations somewhere else, some seen twice, some without a corner of the rig.
void Spoil(double share, std::vector<ViewObservations>* views) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (ViewObservations& view : *views) {
    std::vector<Observation> kept;
    for (Observation o : view.observations) {
      if (unit(random) < 0.3) continue;
      if (unit(random) < share) o.x_px += 300 * (unit(random) - 0.5), o.y_px += 300 * (unit(random) - 0.5);
      if (unit(random) < 0.05) o.x_px += 4 * (unit(random) - 0.5);
      kept.push_back(o);
      if (unit(random) < 0.03) kept.push_back({o.x_px + 0.3, o.y_px, o.node, o.sigma_px, o.confidence});
    }
    std::shuffle(kept.begin(), kept.end(), random);
    view.observations = kept;
  }
}

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
  for (const CloudPoint& point : cloud->points) {
    const auto same = plain.find(point.node);
    ASSERT_NE(same, plain.end());
    EXPECT_EQ(point.views, same->second.views);
    EXPECT_LT((point.position_mm - same->second.point.position_mm).norm(), 0.002 * point.sigma_mm);
    // One factor is common to all entries: the frame's, by how the node's residuals scatter against it.
    const Eigen::Matrix3d &a = point.covariance_mm2, &b = same->second.point.covariance_mm2;
    EXPECT_LT((a / a.trace() - b / b.trace()).norm(), 1e-3);
    EXPECT_GE(a.trace() / b.trace(), 0.4);
  }
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

TEST(RayKernels, StartSumsWhatAccumulateDoesAtTheSamePoints) {
  const Rig rig = RingRig(9);
  const std::vector<ViewObservations> views = Observe(rig, BentSheet(1, 15), 0.15, 5);
  const auto groups = RayGroups::Build(rig, views, {});
  ASSERT_TRUE(groups.ok()) << groups.status();
  RayGroup group;
  ASSERT_TRUE(RayGroupReader(*groups, 0).Next(&group));
  const RayKernels& kernels = BestRayKernels();
  const RayCamera* cameras = groups->cameras().data();
  const RayLimits limits{1, 0.02f, 8, 0.5f, 2.5f};
  RayPoints points;
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    const double angle = (lane - 7.5) * 2.7 / 150;
    points.mm[0][lane] = 150 * std::sin(angle) + 0.2;
    points.mm[1][lane] = -1.35;
    points.mm[2][lane] = 150 * std::cos(angle);
  }
  std::vector<LinearRow> linear(group.count), started(group.count);
  kernels.linearise(cameras, group.rows.data(), group.count, points, limits, linear.data());
  for (LinearRow& row : linear) std::copy(row.inlier, row.inlier + kNodeLanes, row.member);
  const float no_step_mm[3][kNodeLanes] = {};
  GroupSystem system, start;
  kernels.accumulate(linear.data(), group.count, no_step_mm, limits, &system);
  kernels.start(cameras, group.rows.data(), group.count, points, limits, started.data(), &start);
  EXPECT_GT(start.inliers[5], 5);
  EXPECT_EQ(std::memcmp(&system, &start, sizeof system), 0);
}

#ifdef __x86_64__
TEST(RayKernels, SameBytesFromEveryInstructionSet) {
  Rig rig = RingRig(21);
  rig.cameras[3].distortion = {0.3, -0.1, 1e-4, 2e-4, 0.02, 0.35, -0.05, 0.01};
  std::vector<ViewObservations> views = Observe(rig, BentSheet(1, 15), 0.15, 5);
  views[7].observations.push_back(views[7].observations[4]);
  Spoil(0.2, &views);
  TriangulationOptions options;
  options.refinement.calibration_sigma_px = 0.1;
  const auto groups = RayGroups::Build(rig, views, options);
  ASSERT_TRUE(groups.ok()) << groups.status();
  RayGroup group;
  ASSERT_TRUE(RayGroupReader(*groups, 0).Next(&group));
  ASSERT_GE(group.count, 21);
  struct Results {
    RayRow rows[64];
    LinearRow linear[64], started[64];
    GroupScore score;
    GroupSystem system, start;
  };
  const auto run = [&](const RayKernels& kernels, Results* out) {
    std::memset(static_cast<void*>(out), 0, sizeof *out);
    std::memcpy(static_cast<void*>(out->rows), group.rows.data(), group.count * sizeof(RayRow));
    RayPoints points;
    points.anchor = 3;
    float step_mm[3][kNodeLanes];
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      const double angle = (lane - 7.5) * 2.7 / 150;
      points.mm[0][lane] = 150 * std::sin(angle) + 0.2;
      points.mm[1][lane] = -1.35 + 0.01 * lane;
      points.mm[2][lane] = 150 * std::cos(angle);
      for (int k = 0; k < 3; ++k) step_mm[k][lane] = 0.01f * static_cast<float>(k + lane - 9);
    }
    const RayLimits limits{1, 0.02f, 8, 0.5f, 2.5f};
    const RayCamera* cameras = groups->cameras().data();
    kernels.undistort(cameras, group.count, out->rows);
    kernels.score(cameras, out->rows, group.count, points, limits.radius_mm2, &out->score);
    kernels.linearise(cameras, out->rows, group.count, points, limits, out->linear);
    for (LinearRow& row : out->linear) std::copy(row.inlier, row.inlier + kNodeLanes, row.member);
    kernels.accumulate(out->linear, group.count, step_mm, limits, &out->system);
    kernels.start(cameras, out->rows, group.count, points, limits, out->started, &out->start);
  };
  auto one = std::make_unique<Results>(), other = std::make_unique<Results>();
  run(baseline::kRayKernels, one.get());
  EXPECT_GT(one->score.cameras[5], 8);
  EXPECT_GT(one->system.inliers[5], 8);
  EXPECT_GT(one->system.matrix[0][5], 0);
  EXPECT_GT(one->start.matrix[0][5], 0);
  if (__builtin_cpu_supports("avx2")) {
    run(avx2::kRayKernels, other.get());
    EXPECT_EQ(std::memcmp(one.get(), other.get(), sizeof(Results)), 0);
  }
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) {
    run(avx512::kRayKernels, other.get());
    EXPECT_EQ(std::memcmp(one.get(), other.get(), sizeof(Results)), 0);
  }
}
#endif

}  // namespace
}  // namespace weft
