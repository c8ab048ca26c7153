// The kernels against the plain path, and against each other.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/triangulation/plain_triangulation.h"
#include "tests/triangulation/synthetic_views.h"
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

#ifdef __x86_64__
TEST(RayKernels, SameBytesFromEveryInstructionSet) {
  const Rig rig = RingRig(1);
  RayCamera camera{};
  camera.fx_px = 4600, camera.fy_px = 4610, camera.cx_px = 1185, camera.cy_px = 2049;
  const double distortion[] = {-0.12, 0.35, 4e-4, -3e-4, -0.4, 0.01, 0, 0};
  std::copy(std::begin(distortion), std::end(distortion), camera.distortion);
  camera.calibration_px2 = 0.01f;
  camera.safe_square = 1;
  for (int i = 0; i < 9; ++i) camera.rotation[i] = rig.cameras[0].rotation(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) {
    camera.origin_mm[i] = rig.cameras[0].CenterWorld()[i];
    camera.axis[i] = static_cast<float>(camera.rotation[6 + i]);
  }
  struct Results {
    RayRecord rays[RayColumns::kCount];
    int32_t valid[RayColumns::kCount];
    LocalTile local[3];
    RayScore score;
    RaySystem system;
  };
  const auto run = [&](const RayKernels& kernels, Results* out) {
    std::memset(static_cast<void*>(out), 0, sizeof *out);
    std::mt19937 random(5);
    RayColumns columns;
    for (int i = 0; i < RayColumns::kCount; ++i) {
      columns.x_px[i] = 1185 + 0.01 * (random() % 2000);
      columns.y_px[i] = 2049 + 0.01 * (random() % 2000);
      columns.sigma_px[i] = 0.01f * static_cast<float>(1 + random() % 20);
      columns.record[i] = &out->rays[i];
    }
    kernels.unproject(&camera, 0, 48, &columns);
    std::copy(columns.valid, columns.valid + 48, out->valid);
    const RayLimits limits{400, 0.02f, 8, 0.5f, 2.5f};
    const double reference_mm[3] = {3, -2, 1};
    const float point_mm[3] = {0.2f, 0.4f, -0.3f};
    kernels.localise(&camera, out->rays, 37, reference_mm, limits, out->local);
    out->score = kernels.score(out->local, 37, point_mm, 25.0f, 0);
    kernels.linearise(out->local, 37, point_mm, limits, true, &out->system);
  };
  auto one = std::make_unique<Results>(), other = std::make_unique<Results>();
  run(baseline::kRayKernels, one.get());
  EXPECT_GT(one->score.rays, 3);
  EXPECT_GT(one->system.matrix[0], 0);
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
