#include "evaluation/true_drift.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/evaluation/shapes.h"

namespace weft {
namespace {

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

// Cloth rolled ever tighter, turning and travelling; the registered mesh slides along it by `slide_mm` per
// frame.
struct Rolling {
  std::vector<Eigen::Vector3d> truth_mm, registered_mm;
};
Rolling FrameOf(int frame, double slide_mm, double lift_mm) {
  const double radius = 60 - 3 * frame;
  const Eigen::AngleAxisd turn(0.2 * frame, Eigen::Vector3d(1, 2, 3).normalized());
  const Eigen::Vector3d way(5.0 * frame, -3, 2.0 * frame);
  const auto place = [&](double x, double y) {
    return Eigen::Vector3d(turn * (Rolled(radius)(x, y) + Eigen::Vector3d(-radius, 0, 0)) + way);
  };
  const auto slid = [&](double x, double y) {
    const Eigen::Vector3d out = turn * Eigen::Vector3d(std::sin((x + slide_mm * frame) / radius), 0,
                                                       std::cos((x + slide_mm * frame) / radius));
    return Eigen::Vector3d(place(x + slide_mm * frame, y) + lift_mm * frame * out);
  };
  return {Sheet(20, 25, 2, 0, place).vertices_mm, Sheet(20, 25, 2, 0, slid).vertices_mm};
}

TEST(TrueDrift, SlidingIsItsSpeedHoweverTheClothMoves) {
  constexpr double kSpeed_mm_s = 2, kFrameRate = 30;
  const TrueDrift drift(Sheet(20, 25, 2, 0, Flat));
  for (int frame = 0; frame < 4; ++frame) {
    const Rolling a = FrameOf(frame, kSpeed_mm_s / kFrameRate, 0),
                  b = FrameOf(frame + 1, kSpeed_mm_s / kFrameRate, 0);
    const double found = kFrameRate * Mean(DriftBetween(drift.MaterialOffsets(a.registered_mm, a.truth_mm),
                                                        drift.MaterialOffsets(b.registered_mm, b.truth_mm)));
    EXPECT_NEAR(found, kSpeed_mm_s, 0.05 * kSpeed_mm_s) << frame;
  }
}

TEST(TrueDrift, MovingWithTheClothIsNone) {
  const TrueDrift drift(Sheet(20, 25, 2, 0, Flat));
  const Rolling a = FrameOf(0, 0, 0), b = FrameOf(3, 0, 0);
  EXPECT_LT(Mean(DriftBetween(drift.MaterialOffsets(a.registered_mm, a.truth_mm),
                              drift.MaterialOffsets(b.registered_mm, b.truth_mm))),
            1e-9);
}

TEST(TrueDrift, LiftingOffTheSurfaceIsNone) {
  const TrueDrift drift(Sheet(20, 25, 2, 0, Flat));
  const Rolling a = FrameOf(0, 0, 0.3), b = FrameOf(1, 0, 0.3);
  EXPECT_LT(Mean(DriftBetween(drift.MaterialOffsets(a.registered_mm, a.truth_mm),
                              drift.MaterialOffsets(b.registered_mm, b.truth_mm))),
            0.02);
}

TEST(TrueDrift, LoneVerticesHaveNone) {
  TriangleMesh mesh = Sheet(3, 3, 1, 0, Flat);
  mesh.vertices_mm.emplace_back(9, 9, 9);
  const auto offsets = TrueDrift(mesh).MaterialOffsets(mesh.vertices_mm, mesh.vertices_mm);
  EXPECT_TRUE(std::isnan(offsets.back().x()));
  EXPECT_EQ(offsets[4].norm(), 0);
}

}  // namespace
}  // namespace weft
