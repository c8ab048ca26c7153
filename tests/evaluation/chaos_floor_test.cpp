#include "evaluation/chaos_floor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using Eigen::Vector3d;

const std::vector<Face> kTriangle = {{0, 1, 2}};

std::vector<Vector3d> Turned(const std::vector<Vector3d>& x, double degrees) {
  const double a = degrees * M_PI / 180;
  std::vector<Vector3d> out;
  for (const Vector3d& p : x)
    out.emplace_back(p.x(), std::cos(a) * p.y() - std::sin(a) * p.z(),
                     std::sin(a) * p.y() + std::cos(a) * p.z());
  return out;
}

TEST(ChaosFloor, TellsDistancesAndAnglesAfterTheFirstHalfSecond) {
  const std::vector<Vector3d> a = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  std::vector<Vector3d> far = a, near = a;
  for (Vector3d& p : far) p.x() += 100;
  near[0].z() += 3, near[1].z() += 3, near[2].z() += 3;

  ChaosFloor floor;
  EXPECT_FALSE(floor.DistanceMm());
  floor.Add(0.49, a, far, kTriangle);
  EXPECT_FALSE(floor.DistanceMm());
  floor.Add(0.5, a, near, kTriangle);
  ASSERT_TRUE(floor.DistanceMm());
  EXPECT_EQ(floor.frames(), 1);
  EXPECT_DOUBLE_EQ(floor.DistanceMm()->mean, 3);
  EXPECT_NEAR(floor.NormalsDeg()->max, 0, 1e-9);

  floor.Add(1, a, a, kTriangle);
  EXPECT_EQ(floor.frames(), 2);
  EXPECT_DOUBLE_EQ(floor.DistanceMm()->mean, 1.5);
  EXPECT_EQ(floor.FrameMeansMm(), (std::vector<double>{3, 0}));
}

TEST(ChaosFloor, JitterIsTheSecondDifferenceOverThreeFrames) {
  const std::vector<Vector3d> a = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  ChaosFloor floor;
  // 0, 1, 4, 9: second differences of 2.
  for (int k = 0; k < 4; ++k) {
    std::vector<Vector3d> b = a;
    for (Vector3d& p : b) p.y() += k * k;
    EXPECT_EQ(floor.ErrorJitterMm().has_value(), k > 2);
    floor.Add(1 + k / 30.0, a, b, kTriangle);
  }
  EXPECT_NEAR(floor.ErrorJitterMm()->mean, 2, 1e-12);
  EXPECT_NEAR(floor.ErrorJitterMm()->max, 2, 1e-12);
}

TEST(ChaosFloor, MeasuresSmallAndLargeAngles) {
  const std::vector<Vector3d> a = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  for (const double degrees : {1e-4, 5.0, 90.0, 179.0}) {
    ChaosFloor floor;
    floor.Add(1, a, Turned(a, degrees), kTriangle);
    EXPECT_NEAR(floor.NormalsDeg()->mean, degrees, 1e-6 * degrees);
  }
}

}  // namespace
}  // namespace weft
