// The kernels by themselves, and their builds against each other.
#include "triangulation/ray_kernel.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "tests/triangulation/synthetic_views.h"
#include "triangulation/ray_groups.h"

namespace weft {
namespace {

using testing::BentSheet;
using testing::Observe;
using testing::RingRig;
using testing::Spoil;

// Of a strip of BentSheet, so far beside it.
RayPoints PointsBesideStrip(double x_mm) {
  RayPoints points;
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    const double angle = (lane - 7.5) * 2.7 / 150;
    points.mm[0][lane] = 150 * std::sin(angle) + x_mm;
    points.mm[1][lane] = -1.35;
    points.mm[2][lane] = 150 * std::cos(angle);
  }
  return points;
}

// The first group of a bent strip of so many cells.
struct Strip {
  Strip(int cameras, int cells, double sigma_px, uint32_t seed)
      : Strip(RingRig(cameras), Observe(RingRig(cameras), BentSheet(1, cells), sigma_px, seed), {}) {}
  Strip(const Rig& rig, std::vector<ViewObservations> seen, const TriangulationOptions& options)
      : views(std::move(seen)), groups(RayGroups::Build(rig, views, options)) {
    EXPECT_TRUE(groups.ok() && RayGroupReader(*groups, 0).Next(&group)) << groups.status();
  }
  const RayCamera* cameras() const { return groups->cameras().data(); }

  std::vector<ViewObservations> views;
  absl::StatusOr<RayGroups> groups;
  RayGroup group;
};

// Steps of no length for all nodes.
RaySteps AllStepping() {
  RaySteps steps;
  std::fill_n(steps.wanted, kNodeLanes, 1);
  return steps;
}

// The rays that are inliers take part from now on.
void TakeInliers(LinearRow* row) {
  for (int lane = 0; lane < kNodeLanes; ++lane)
    row->weight[lane] = row->inlier[lane] != 0 ? row->inverse_variance[lane] : 0;
}

TEST(RayKernels, StartSumsWhatAccumulateDoesWithoutHubersWeight) {
  const Strip strip(9, 15, 0.15, 5);
  const RayGroup& group = strip.group;
  const RayKernels& kernels = BestRayKernels();
  const RayCamera* cameras = strip.cameras();
  RayLimits limits{1, 0.02f, 8, 0.5f, 1e9f};
  const RayPoints points = PointsBesideStrip(0.2);
  std::vector<LinearRow> linear(group.count), started(group.count);
  limits.checks_distance =
      kernels.linearise(cameras, group.rows.data(), group.count, points, limits, linear.data());
  for (LinearRow& row : linear) TakeInliers(&row);
  const RaySteps no_steps = AllStepping();
  GroupSystem system, start;
  kernels.accumulate(linear.data(), group.count, no_steps, limits, &system);
  kernels.start(cameras, group.rows.data(), group.count, points, limits, started.data(), &start);
  EXPECT_GT(system.inliers[5], 5);
  EXPECT_GT(start.chi_square[5], 0);
  EXPECT_EQ(std::memcmp(system.matrix, start.matrix, sizeof system.matrix), 0);
  EXPECT_EQ(std::memcmp(system.gradient, start.gradient, sizeof system.gradient), 0);
  EXPECT_EQ(std::memcmp(system.chi_square, start.chi_square, sizeof system.chi_square), 0);
}

TEST(RayKernels, RaysAndLensAreThoseOfTheCameraModel) {
  Rig rig = RingRig(9);
  rig.cameras[3].distortion = {0.3, -0.1, 1e-4, 2e-4, 0.02, 0.35, -0.05, 0.01};
  rig.cameras[4].distortion = {-0.2, 0.05, -5e-4, 3e-4, 0.01, 0, 0, 0};
  const Strip strip(rig, Observe(rig, BentSheet(1, 16), 0.15, 5), {});
  int rays = 0;
  for (int i = 0; i < strip.group.count; ++i) {
    const RayRow& row = strip.group.rows[i];
    CameraModel camera = rig.cameras[row.camera];
    camera.rotation.setIdentity();
    camera.translation_mm.setZero();
    const auto pixel_of = [&](double x, double y) -> Eigen::Vector2d {
      const Eigen::Vector2d px = *camera.Project({1000 * x, 1000 * y, 1000});
      return {(px.x() - camera.cx_px) / camera.fx_px, (px.y() - camera.cy_px) / camera.fy_px};
    };
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      if (!(row.sigma_px[lane] > 0)) continue;
      ++rays;
      const double x = double{row.pixel[0][lane]} + row.to_ray[0][lane];
      const double y = double{row.pixel[1][lane]} + row.to_ray[1][lane];
      const Eigen::Vector2d pixel(row.pixel[0][lane], row.pixel[1][lane]);
      EXPECT_LT((pixel_of(x, y) - pixel).norm(), 1e-7) << i << " " << lane;
      constexpr double kStep = 1e-4;
      const Eigen::Vector2d by_x = (pixel_of(x + kStep, y) - pixel_of(x - kStep, y)) / (2 * kStep);
      const Eigen::Vector2d by_y = (pixel_of(x, y + kStep) - pixel_of(x, y - kStep)) / (2 * kStep);
      EXPECT_NEAR(row.lens[0][lane], by_x.x(), 1e-3);
      EXPECT_NEAR(row.lens[1][lane], by_x.y(), 1e-3);
      EXPECT_NEAR(row.lens[1][lane], by_y.x(), 1e-3);
      EXPECT_NEAR(row.lens[2][lane], by_y.y(), 1e-3);
    }
  }
  EXPECT_GT(rays, 80);
}

// Rows linearised 0.2 mm beside a strip of the sheet, all rays within 1 mm taking part.
struct LinearStrip {
  LinearStrip(double sigma_px, uint32_t seed) {
    const Strip strip(24, 16, sigma_px, seed);
    rows.resize(strip.group.count);
    BestRayKernels().linearise(strip.cameras(), strip.group.rows.data(), strip.group.count,
                               PointsBesideStrip(0.2), limits, rows.data());
    for (LinearRow& row : rows) TakeInliers(&row);
  }
  GroupSystem At(const RaySteps& steps) {
    GroupSystem system;
    BestRayKernels().accumulate(rows.data(), static_cast<int>(rows.size()), steps, limits, &system);
    return system;
  }

  RayLimits limits{1, 0.02f, 8, 0.5f, 2.5f};
  std::vector<LinearRow> rows;
};

Eigen::Matrix3d SymmetricOf(const float (*entries)[kNodeLanes], int lane) {
  const auto m = [&](int k) { return static_cast<double>(entries[k][lane]); };
  Eigen::Matrix3d out;
  out << m(0), m(1), m(2), m(1), m(3), m(4), m(2), m(4), m(5);
  return out;
}

TEST(RayKernels, SurplusMakesTheMatrixTheDerivativeOfHubersGradient) {
  LinearStrip strip(0.3, 5);
  for (int axis = 0; axis < 3; ++axis) {
    constexpr float kStepMm = 2e-3f;
    RaySteps forward = AllStepping(), backward = AllStepping();
    std::fill_n(forward.mm[axis], kNodeLanes, kStepMm);
    std::fill_n(backward.mm[axis], kNodeLanes, -kStepMm);
    const GroupSystem here = strip.At(AllStepping()), forth = strip.At(forward), back = strip.At(backward);
    int equal = 0;
    double without = 0;
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      const Eigen::Matrix3d robust = SymmetricOf(here.matrix, lane);
      const Eigen::Matrix3d newton = robust - SymmetricOf(here.surplus, lane);
      Eigen::Vector3d difference;
      for (int k = 0; k < 3; ++k)
        difference[k] = (forth.gradient[k][lane] - back.gradient[k][lane]) / (2.0 * kStepMm);
      equal += (newton.col(axis) - difference).norm() < 1e-3 * difference.norm() ? 1 : 0;
      without = std::max(without, (robust.col(axis) - difference).norm() / difference.norm());
    }
    EXPECT_GE(equal, 14) << axis;  // of 16: a ray may pass the bound in between
    EXPECT_GT(without, 0.1) << axis;
  }
}

TEST(RayKernels, NodesThatAreNotWantedChangeNothingForTheOthers) {
  LinearStrip strip(0.3, 5);
  RaySteps some;
  some.wanted[2] = 1;
  const GroupSystem all = strip.At(AllStepping()), one = strip.At(some);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(one.matrix[k][2], all.matrix[k][2]);
  EXPECT_EQ(one.chi_square[2], all.chi_square[2]);
  EXPECT_GT(one.inliers[2], 5);
}

TEST(RayKernels, SolvesAsEigenDoes) {
  LinearStrip strip(0.5, 6);
  GroupSystem system = strip.At(AllStepping());
  for (auto& entry : system.matrix) entry[3] = 0;  // no rays
  for (auto& entry : system.surplus) entry[3] = 0;
  for (int k = 0; k < 6; ++k) system.surplus[k][4] = system.matrix[k][4];  // all beyond the bound
  GroupSolution solution;
  BestRayKernels().solve(system, &solution);
  EXPECT_EQ(solution.newton[4], 0);
  int newtons = 0;
  for (const int32_t newton : solution.newton) newtons += newton != 0 ? 1 : 0;
  EXPECT_GT(newtons, 4);
  for (int lane = 0; lane < kNodeLanes; ++lane) {
    EXPECT_EQ(solution.solvable[lane] != 0, lane != 3) << lane;
    if (lane == 3) continue;
    const Eigen::Matrix3d robust = SymmetricOf(system.matrix, lane);
    const Eigen::Matrix3d inverse = robust.inverse();
    const double* const entries[] = {solution.covariance_mm2[0], solution.covariance_mm2[1],
                                     solution.covariance_mm2[2], solution.covariance_mm2[3],
                                     solution.covariance_mm2[4], solution.covariance_mm2[5]};
    const double expected[] = {inverse(0, 0), inverse(0, 1), inverse(0, 2),
                               inverse(1, 1), inverse(1, 2), inverse(2, 2)};
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(entries[k][lane], expected[k], 1e-9 * inverse.norm());
    const Eigen::Vector3d gradient(system.gradient[0][lane], system.gradient[1][lane],
                                   system.gradient[2][lane]);
    const Eigen::Matrix3d newton = robust - SymmetricOf(system.surplus, lane);
    EXPECT_EQ(solution.newton[lane] != 0, newton.determinant() > 0.1 * robust.determinant()) << lane;
    const Eigen::Vector3d step = newton.inverse() * gradient;
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(lane == 4 || std::abs(solution.newton_step_mm[k][lane] - step[k]) < 1e-9 * step.norm());
  }
}

TEST(RayKernels, ScoreEndsOnceAllHaveEnough) {
  const Strip strip(60, 16, 0.15, 5);
  const RayGroup& group = strip.group;
  const RayPoints points = PointsBesideStrip(0);
  const auto cameras_with = [&](float enough, int idle_lane) {
    float per_lane[kNodeLanes];
    std::fill_n(per_lane, kNodeLanes, enough);
    per_lane[idle_lane] = 0;
    GroupScore score;
    BestRayKernels().score(strip.cameras(), group.rows.data(), group.count, points, 1, per_lane, &score);
    return score;
  };
  const GroupScore all = cameras_with(1000, 0), some = cameras_with(5, 0);
  for (int lane = 1; lane < kNodeLanes; ++lane) {
    EXPECT_GT(all.cameras[lane], 15) << lane;
    EXPECT_GE(some.cameras[lane], 5) << lane;
    EXPECT_LE(some.cameras[lane], all.cameras[lane]) << lane;
  }
  EXPECT_LT(some.cameras[1], all.cameras[1]);
}

TEST(RayKernels, DistancesAreComparedWhereResidualsDoNotLimitThem) {
  const Strip strip(9, 16, 0.15, 5);
  const RayGroup& group = strip.group;
  const RayPoints points = PointsBesideStrip(0);
  const RayKernels& kernels = BestRayKernels();
  std::vector<LinearRow> linear(group.count);
  const auto checks = [&](float radius_mm) {
    const RayLimits limits{radius_mm * radius_mm, 0.02f, 8, 0.5f, 2.5f};
    return kernels.linearise(strip.cameras(), group.rows.data(), group.count, points, limits, linear.data());
  };
  // Residuals of up to 1.2 px are half a millimetre or so.
  EXPECT_FALSE(checks(3));
  EXPECT_TRUE(checks(0.1f));
  // What is said to be needless makes no difference.
  RayLimits limits{9, 0.02f, 8, 0.5f, 2.5f};
  checks(3);
  for (LinearRow& row : linear) TakeInliers(&row);
  RaySteps steps = AllStepping();
  for (auto& component : steps.mm)
    for (int lane = 0; lane < kNodeLanes; ++lane) component[lane] = 0.04f * static_cast<float>(lane);
  GroupSystem with, without;
  kernels.accumulate(linear.data(), group.count, steps, limits, &with);
  limits.checks_distance = false;
  kernels.accumulate(linear.data(), group.count, steps, limits, &without);
  EXPECT_EQ(std::memcmp(&with, &without, sizeof with), 0);
  EXPECT_GT(with.inliers[0], with.inliers[15]);
}

TEST(RayKernels, ReadsRowsThatAreWholeAndRefusesOthers) {
  std::vector<Observation> seen;
  for (int lane = 0; lane < kNodeLanes; ++lane)
    seen.push_back(
        {1000.25 + 5 * lane, 700.5 - lane, {7, 32 + lane, NodeKind::kCorner}, 0.1f + 0.01f * lane, 1});
  RayCamera camera = {};
  camera.center_px[0] = 640.5, camera.center_px[1] = 480.25;
  camera.inverse_focal_px[0] = 1.0 / 2048, camera.inverse_focal_px[1] = 1.0 / 4096;
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
    ASSERT_TRUE(kernels->read(camera, seen.data(), &row));
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      EXPECT_NEAR(double{row.pixel[0][lane]} + row.to_ray[0][lane], (seen[lane].x_px - 640.5) / 2048, 1e-15);
      EXPECT_NEAR(double{row.pixel[1][lane]} + row.to_ray[1][lane], (seen[lane].y_px - 480.25) / 4096, 1e-15);
      EXPECT_EQ(row.sigma_px[lane], seen[lane].sigma_px);
    }
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      const auto refuses = [&](auto change) {
        return !kernels->read(camera, with(lane, change).data(), &row);
      };
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
  const Strip strip(rig, views, options);
  const RayGroup& group = strip.group;
  ASSERT_GE(group.count, 21);
  struct Results {
    RayRow rows[64];
    LinearRow linear[64], started[64];
    GroupScore score;
    GroupSystem system, start;
    GroupSolution solution;
  };
  const auto run = [&](const RayKernels& kernels, Results* out) {
    std::memset(static_cast<void*>(out), 0, sizeof *out);
    std::memcpy(static_cast<void*>(out->rows), group.rows.data(), group.count * sizeof(RayRow));
    RayPoints points = PointsBesideStrip(0.2);
    points.anchor = 3;
    RaySteps steps = AllStepping();
    for (int lane = 0; lane < kNodeLanes; ++lane) {
      points.mm[1][lane] += 0.01 * lane;
      for (int k = 0; k < 3; ++k) steps.mm[k][lane] = 0.01f * static_cast<float>(k + lane - 9);
    }
    const RayLimits limits{1, 0.02f, 8, 0.5f, 2.5f};
    const RayCamera* cameras = strip.cameras();
    kernels.undistort(cameras, group.count, out->rows);
    float never[kNodeLanes];
    std::fill_n(never, kNodeLanes, 1e9f);
    kernels.score(cameras, out->rows, group.count, points, limits.radius_mm2, never, &out->score);
    kernels.linearise(cameras, out->rows, group.count, points, limits, out->linear);
    for (LinearRow& row : out->linear) TakeInliers(&row);
    kernels.accumulate(out->linear, group.count, steps, limits, &out->system);
    kernels.start(cameras, out->rows, group.count, points, limits, out->started, &out->start);
    kernels.solve(out->system, &out->solution);
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
