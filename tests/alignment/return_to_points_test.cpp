#include "alignment/return_to_points.h"

#include <gtest/gtest.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using testing::kCellMm;
using testing::Mapped;
using testing::MeanError;
using testing::Measure;
using testing::SheetTemplate;

constexpr int kSheetRows = 24, kSheetCols = 48;
constexpr double kNoiseMm = 0.06;
constexpr int kPleatCells = 6;

// Sharp pleats across the sheet, each kPleatCells wide, with right angles between them.
Eigen::Vector3d Pleated(const Eigen::Vector3d& p) {
  const double width_mm = kPleatCells * kCellMm, along = p.x() / width_mm;
  const int pleat = static_cast<int>(std::floor(along));
  const double inside = along - pleat, height = pleat % 2 == 0 ? inside : 1 - inside;
  return {std::sqrt(0.5) * p.x(), p.y(), std::sqrt(0.5) * width_mm * height};
}

bool IsCrease(int v) { return v % kSheetCols % kPleatCells == 0 && v % kSheetCols > 0; }

std::vector<VertexTarget> MeasureWithSigma(const std::vector<Eigen::Vector3d>& truth) {
  std::vector<VertexTarget> targets = Measure(truth, kNoiseMm, 7);
  for (VertexTarget& t : targets) t.sigma_mm = kNoiseMm;
  return targets;
}

std::vector<Eigen::Vector3d> PointsOf(const std::vector<VertexTarget>& targets) {
  std::vector<Eigen::Vector3d> points_mm;
  for (const VertexTarget& t : targets) points_mm.push_back(t.position_mm);
  return points_mm;
}

TEST(ReturnToPoints, TheMeshIsNearlyAsGoodAsItsCloudInCreases) {
  const Template garment = SheetTemplate(FlatSheet(kSheetRows, kSheetCols));
  const auto truth = Mapped(garment.rest.vertices_mm, Pleated);
  const auto targets = MeasureWithSigma(truth);
  AlignOptions options;
  options.noise_sigmas = 0;
  const auto bent_flat = Align(garment, targets, options), result = Align(garment, targets, AlignOptions{});
  ASSERT_TRUE(bent_flat.ok() && result.ok());
  const double cloud_mm = MeanError(PointsOf(targets), truth, IsCrease);
  EXPECT_GT(MeanError(bent_flat->mesh.vertices_mm, truth, IsCrease), 1.2 * cloud_mm);
  EXPECT_LT(MeanError(result->mesh.vertices_mm, truth, IsCrease), 1.1 * cloud_mm);
}

TEST(ReturnToPoints, FlatClothStaysSmootherThanItsCloud) {
  const Template garment = SheetTemplate(FlatSheet(kSheetRows, kSheetCols));
  const std::vector<Eigen::Vector3d>& truth = garment.rest.vertices_mm;
  const auto targets = MeasureWithSigma(truth);
  AlignOptions options;
  const auto result = Align(garment, targets, options);
  options.noise_sigmas = 0;
  const auto smooth = Align(garment, targets, options);
  ASSERT_TRUE(result.ok() && smooth.ok());
  const auto all = [](int) { return true; };
  const double cloud_mm = MeanError(PointsOf(targets), truth, all);
  const double smooth_mm = MeanError(smooth->mesh.vertices_mm, truth, all);
  ASSERT_LT(smooth_mm, 0.9 * cloud_mm);
  // Of what smoothing gains, less than a third is given back.
  EXPECT_LT(MeanError(result->mesh.vertices_mm, truth, all), smooth_mm + 0.33 * (cloud_mm - smooth_mm));
}

// E_Dist takes most of such noise away; none of it may come back.
TEST(ReturnToPoints, NoiseOfHalfAMillimetreStaysSmoothedAway) {
  const Template garment = SheetTemplate(FlatSheet(kSheetRows, kSheetCols));
  const std::vector<Eigen::Vector3d>& truth = garment.rest.vertices_mm;
  std::vector<VertexTarget> targets = Measure(truth, 0.5, 8);
  for (VertexTarget& t : targets) t.sigma_mm = 0.5;
  AlignOptions options;
  const auto result = Align(garment, targets, options);
  options.noise_sigmas = 0;
  const auto smooth = Align(garment, targets, options);
  ASSERT_TRUE(result.ok() && smooth.ok());
  const auto all = [](int) { return true; };
  EXPECT_LT(MeanError(result->mesh.vertices_mm, truth, all),
            1.05 * MeanError(smooth->mesh.vertices_mm, truth, all));
}

// A vertex 3 mm from a point of 0.1 mm by x and y, 1 mm by z.
TEST(ReturnToPoints, PoorlyKnownDirectionsFollowTheCloth) {
  VertexTarget target{.vertex = 0, .sigma_mm = 0.585, .views = 2};
  target.covariance_mm2.diagonal() << 0.01, 0.01, 1;
  std::vector<Eigen::Vector3d> across = {{3, 0, 0}}, along = {{0, 0, 3}};
  ReturnToPoints({target}, {}, &across);
  ReturnToPoints({target}, {}, &along);
  EXPECT_LT(across[0].x(), 0.01);
  EXPECT_GT(along[0].z(), 1.5);
}

TEST(ReturnToPoints, FoldsAreNoNoise) {
  VertexTarget target{.vertex = 0, .sigma_mm = 0.5, .views = 3};
  target.covariance_mm2.diagonal().setConstant(0.25);
  std::vector<Eigen::Vector3d> noisy = {{2, 0, 0}}, folded = noisy;
  ReturnToPoints({target}, {}, &noisy);
  target.fold_covariance_mm2.diagonal().setConstant(0.24);
  ReturnToPoints({target}, {}, &folded);
  EXPECT_GT(noisy[0].x(), 0.3);
  EXPECT_LT(folded[0].x(), 0.05);
}

TEST(ReturnToPoints, UnknownSigmasAndZeroLeaveVerticesWhereTheyAre) {
  std::vector<Eigen::Vector3d> position_mm = {{1, 2, 3}};
  ReturnToPoints({{.vertex = 0, .views = 3}}, {}, &position_mm);
  EXPECT_EQ(position_mm[0], Eigen::Vector3d(1, 2, 3));
  AlignOptions off;
  off.noise_sigmas = 0;
  ReturnToPoints({{.vertex = 0, .sigma_mm = 0.1, .views = 3}}, off, &position_mm);
  EXPECT_EQ(position_mm[0], Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace weft
