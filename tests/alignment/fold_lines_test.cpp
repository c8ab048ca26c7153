#include "alignment/fold_lines.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::MeanError;

constexpr int kSide = 40;
constexpr double kPointNoiseMm = 0.1;

std::vector<VertexTarget> Points(const std::vector<Eigen::Vector3d>& truth, double noise_mm = kPointNoiseMm) {
  std::vector<VertexTarget> targets = testing::Measure(truth, noise_mm, 3);
  for (VertexTarget& t : targets) t.sigma_mm = noise_mm;
  return targets;
}

bool All(int) { return true; }

class FoldLines : public ::testing::Test {
 protected:
  // Where E_Det and E_Dist alone have the vertices.
  std::vector<Eigen::Vector3d> Smoothed(const std::vector<VertexTarget>& targets) const {
    AlignOptions options;
    options.noise_sigmas = 0;
    const auto result = Align(model_, targets, options);
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? result->mesh.vertices_mm : truth_;
  }

  const AlignmentModel model_{testing::SheetTemplate(testing::FlatSheet(kSide, kSide))};
  const std::vector<Eigen::Vector3d>& truth_ = model_.rest().vertices_mm;
};

// A crease down one column, 0.3 mm too low, and in the last one, at the border.
TEST_F(FoldLines, GetTheirHeightBack) {
  const auto is_crease = [](int v) { return v % kSide == 20 || v % kSide == kSide - 1; };
  std::vector<Eigen::Vector3d> position_mm = truth_;
  for (int v = 0; v < kSide * kSide; ++v) position_mm[v].z() -= is_crease(v) ? 0.3 : 0;
  RestoreFolds(model_, Points(truth_), {}, &position_mm);
  // A mean of five points is off by 0.07 mm in the mean.
  EXPECT_LT(MeanError(position_mm, truth_, is_crease), 0.09);
}

TEST_F(FoldLines, AcrossTheEdgesOfFacesToo) {
  // Every second diagonal of the sheet has edges; the crease runs along one of those.
  const auto is_crease = [](int v) { return v % kSide == v / kSide; };
  std::vector<Eigen::Vector3d> position_mm = truth_;
  for (int v = 0; v < kSide * kSide; ++v) position_mm[v].z() -= is_crease(v) ? 0.3 : 0;
  RestoreFolds(model_, Points(truth_), {}, &position_mm);
  EXPECT_LT(MeanError(position_mm, truth_, is_crease), 0.12);
}

TEST_F(FoldLines, FlatClothStaysAsSmoothAsItIs) {
  const std::vector<VertexTarget> targets = Points(truth_);
  const std::vector<Eigen::Vector3d> smooth_mm = Smoothed(targets);
  std::vector<Eigen::Vector3d> position_mm = smooth_mm;
  RestoreFolds(model_, targets, {}, &position_mm);
  EXPECT_LT(MeanError(position_mm, truth_, All), 1.05 * MeanError(smooth_mm, truth_, All));
}

// By the definition of kNoiseOfBestLine 5 % do.
TEST_F(FoldLines, NoiseAloneMovesFewVertices) {
  for (const double noise_mm : {0.06, 0.15, 0.5}) {
    const std::vector<VertexTarget> targets = Points(truth_, noise_mm);
    const std::vector<Eigen::Vector3d> smooth_mm = Smoothed(targets);
    std::vector<Eigen::Vector3d> position_mm = smooth_mm;
    RestoreFolds(model_, targets, {}, &position_mm);
    int moved = 0;
    for (int v = 0; v < kSide * kSide; ++v) moved += position_mm[v] != smooth_mm[v];
    EXPECT_GT(moved, 0.02 * kSide * kSide) << noise_mm;
    EXPECT_LT(moved, 0.1 * kSide * kSide) << noise_mm;
  }
}

TEST_F(FoldLines, SingleVerticesAreNoFolds) {
  std::vector<Eigen::Vector3d> position_mm = truth_;
  position_mm[20 * kSide + 20].z() -= 0.15;
  std::vector<VertexTarget> targets = Points(truth_);
  for (VertexTarget& t : targets) t.position_mm = truth_[t.vertex];
  const std::vector<Eigen::Vector3d> before_mm = position_mm;
  RestoreFolds(model_, targets, {}, &position_mm);
  EXPECT_EQ(position_mm, before_mm);
}

TEST_F(FoldLines, PointsOfUnknownNoiseCountNothing) {
  std::vector<Eigen::Vector3d> position_mm = truth_;
  for (int v = 0; v < kSide * kSide; ++v) position_mm[v].z() -= v % kSide == 20 ? 0.3 : 0;
  const std::vector<Eigen::Vector3d> before_mm = position_mm;
  RestoreFolds(model_, testing::Measure(truth_, kPointNoiseMm, 3), {}, &position_mm);
  EXPECT_EQ(position_mm, before_mm);
}

TEST_F(FoldLines, TheSameAtAnyThreadCount) {
  const std::vector<VertexTarget> targets = Points(truth_);
  const auto run = [&](int threads) {
    std::vector<Eigen::Vector3d> position_mm = truth_;
    for (int v = 0; v < kSide * kSide; ++v) position_mm[v].z() -= v % kSide == 20 ? 0.3 : 0;
    tbb::task_arena(threads).execute([&] { RestoreFolds(model_, targets, {}, &position_mm); });
    return position_mm;
  };
  EXPECT_EQ(run(1), run(2));
}

}  // namespace
}  // namespace weft
