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
    EXPECT_LT((point.position_mm - same->second.point.position_mm).norm(), 0.015 * point.sigma_mm);
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

// The rays that are inliers take part from now on.
void TakeInliers(LinearRow* row) {
  for (int lane = 0; lane < kNodeLanes; ++lane)
    row->weight[lane] = row->inlier[lane] != 0 ? row->inverse_variance[lane] : 0;
}

TEST(RayKernels, StartSumsWhatAccumulateDoesWithoutHubersWeight) {
  const Rig rig = RingRig(9);
  const std::vector<ViewObservations> views = Observe(rig, BentSheet(1, 15), 0.15, 5);
  const auto groups = RayGroups::Build(rig, views, {});
  ASSERT_TRUE(groups.ok()) << groups.status();
  RayGroup group;
  ASSERT_TRUE(RayGroupReader(*groups, 0).Next(&group));
  const RayKernels& kernels = BestRayKernels();
  const RayCamera* cameras = groups->cameras().data();
  RayLimits limits{1, 0.02f, 8, 0.5f, 1e9f};
  RayPoints points;
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    const double angle = (lane - 7.5) * 2.7 / 150;
    points.mm[0][lane] = 150 * std::sin(angle) + 0.2;
    points.mm[1][lane] = -1.35;
    points.mm[2][lane] = 150 * std::cos(angle);
  }
  std::vector<LinearRow> linear(group.count), started(group.count);
  limits.checks_distance =
      kernels.linearise(cameras, group.rows.data(), group.count, points, limits, linear.data());
  for (LinearRow& row : linear) TakeInliers(&row);
  const float no_step_mm[3][kNodeLanes] = {};
  GroupSystem system, start;
  kernels.accumulate(linear.data(), group.count, no_step_mm, limits, &system);
  kernels.start(cameras, group.rows.data(), group.count, points, limits, started.data(), &start);
  EXPECT_GT(system.inliers[5], 5);
  EXPECT_GT(start.chi_square[5], 0);
  EXPECT_EQ(std::memcmp(system.matrix, start.matrix, sizeof system.matrix), 0);
  EXPECT_EQ(std::memcmp(system.gradient, start.gradient, sizeof system.gradient), 0);
  EXPECT_EQ(std::memcmp(system.chi_square, start.chi_square, sizeof system.chi_square), 0);
}

TEST(RayKernels, DistancesAreComparedWhereResidualsDoNotLimitThem) {
  const Rig rig = RingRig(9);
  const std::vector<ViewObservations> views = Observe(rig, BentSheet(1, 16), 0.15, 5);
  const auto groups = RayGroups::Build(rig, views, {});
  ASSERT_TRUE(groups.ok()) << groups.status();
  RayGroup group;
  ASSERT_TRUE(RayGroupReader(*groups, 0).Next(&group));
  RayPoints points;
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    const double angle = (lane - 7.5) * 2.7 / 150;
    points.mm[0][lane] = 150 * std::sin(angle);
    points.mm[1][lane] = -1.35;
    points.mm[2][lane] = 150 * std::cos(angle);
  }
  const RayKernels& kernels = BestRayKernels();
  std::vector<LinearRow> linear(group.count);
  const auto checks = [&](float radius_mm) {
    const RayLimits limits{radius_mm * radius_mm, 0.02f, 8, 0.5f, 2.5f};
    return kernels.linearise(groups->cameras().data(), group.rows.data(), group.count, points, limits,
                             linear.data());
  };
  // Residuals of up to 1.2 px are half a millimetre or so.
  EXPECT_FALSE(checks(3));
  EXPECT_TRUE(checks(0.1f));
  // What is said to be needless makes no difference.
  RayLimits limits{9, 0.02f, 8, 0.5f, 2.5f};
  checks(3);
  for (LinearRow& row : linear) TakeInliers(&row);
  float step_mm[3][kNodeLanes];
  for (auto& component : step_mm)
    for (int lane = 0; lane < kNodeLanes; ++lane) component[lane] = 0.04f * static_cast<float>(lane);
  GroupSystem with, without;
  kernels.accumulate(linear.data(), group.count, step_mm, limits, &with);
  limits.checks_distance = false;
  kernels.accumulate(linear.data(), group.count, step_mm, limits, &without);
  EXPECT_EQ(std::memcmp(&with, &without, sizeof with), 0);
  EXPECT_GT(with.inliers[0], with.inliers[15]);
}

TEST(RayKernels, ReadsRowsThatAreWholeAndRefusesOthers) {
  std::vector<Observation> seen;
  for (int lane = 0; lane < kNodeLanes; ++lane)
    seen.push_back(
        {1000.25 + 5 * lane, 700.5 - lane, {7, 32 + lane, NodeKind::kCorner}, 0.1f + 0.01f * lane, 1});
  const auto with = [&](int lane, auto change) {
    std::vector<Observation> changed = seen;
    change(changed[lane]);
    return changed;
  };
  std::vector<const RayKernels*> builds = {&baseline::kRayKernels};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) builds.push_back(&avx2::kRayKernels);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl"))
    builds.push_back(&avx512::kRayKernels);
#endif
  for (const RayKernels* kernels : builds) {
    RayRow row;
    ASSERT_TRUE(kernels->read(seen.data(), &row));
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      EXPECT_EQ(row.pixel_px[0][lane], seen[lane].x_px);
      EXPECT_EQ(row.pixel_px[1][lane], seen[lane].y_px);
      EXPECT_EQ(row.sigma_px[lane], seen[lane].sigma_px);
    }
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      const auto refuses = [&](auto change) { return !kernels->read(with(lane, change).data(), &row); };
      if (lane > 0) {
        EXPECT_TRUE(refuses([](Observation& o) { o.node.row = 8; })) << lane;
        EXPECT_TRUE(refuses([](Observation& o) { ++o.node.col; })) << lane;
        EXPECT_TRUE(refuses([](Observation& o) { o.node.kind = NodeKind::kCenter; })) << lane;
      }
      EXPECT_TRUE(refuses([](Observation& o) { o.x_px = std::nan(""); })) << lane;
      EXPECT_TRUE(refuses([](Observation& o) { o.y_px = HUGE_VAL; })) << lane;
      EXPECT_TRUE(refuses([](Observation& o) { o.sigma_px = 0; })) << lane;
      EXPECT_TRUE(refuses([](Observation& o) { o.sigma_px = -1; })) << lane;
      EXPECT_TRUE(refuses([](Observation& o) { o.sigma_px = std::nanf(""); })) << lane;
    }
  }
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
    for (LinearRow& row : out->linear) TakeInliers(&row);
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
