#include "evaluation/geodesic_distortion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "evaluation/geodesics.h"
#include "tests/evaluation/shapes.h"

namespace weft {
namespace {

TEST(GeodesicDistortion, BentSheetHasNone) {
  const TriangleMesh sheet = Sheet(25, 30, 3, 0, Flat);
  // Chords of the length of the sheet's steps: the polyhedron itself is bent, not stretched.
  const double radius = 3 / 2.0 / std::sin(0.05);
  const TriangleMesh bent = Sheet(25, 30, 0.1, 0, [&](double angle, double y) {
    return Eigen::Vector3d(radius * std::sin(angle), 30 * y, radius * std::cos(angle));
  });
  const auto distortion = GeodesicDistortion::Build(sheet, {});
  ASSERT_TRUE(distortion.ok()) << distortion.status();
  EXPECT_EQ(distortion->sources().size(), 20u);
  const auto score = distortion->Measure(bent.vertices_mm);
  ASSERT_TRUE(score.ok()) << score.status();
  EXPECT_LT(score->mean_mm, 1e-5);
}

TEST(GeodesicDistortion, EvenStretchIsTheStretch) {
  constexpr double kStretch = 0.04;
  const TriangleMesh sheet = Sheet(25, 30, 3, 0.2, Flat);
  TriangleMesh stretched = sheet;
  for (auto& v : stretched.vertices_mm) v *= 1 + kStretch;
  const auto distortion = GeodesicDistortion::Build(sheet, {});
  ASSERT_TRUE(distortion.ok()) << distortion.status();
  const auto score = distortion->Measure(stretched.vertices_mm);
  ASSERT_TRUE(score.ok()) << score.status();
  double expected = 0;
  for (const int s : distortion->sources())
    for (const auto& v : sheet.vertices_mm) expected += kStretch * (v - sheet.vertices_mm[s]).norm();
  expected /= static_cast<double>(distortion->sources().size() * (sheet.vertices_mm.size() - 1));
  EXPECT_NEAR(score->mean_mm, expected, 0.01 * expected);
  EXPECT_NEAR(score->mean_relative, kStretch, 1e-4);
}

TEST(GeodesicDistortion, MeshOfAnotherTemplateIsRefused) {
  const TriangleMesh sheet = Sheet(5, 5, 1, 0, Flat);
  const auto distortion = GeodesicDistortion::Build(sheet, {});
  ASSERT_TRUE(distortion.ok());
  EXPECT_EQ(distortion->Measure({}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(GeodesicDistortion::Build(sheet, {.sources = 0}).ok());
}

}  // namespace
}  // namespace weft
