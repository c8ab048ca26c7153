#include "alignment/cloth_continuation.h"

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

constexpr int kRows = 24, kCols = 40, kCurlFrom = 30;
constexpr double kRadiusMm = 5;  // 31 degrees a cell

// A flat sheet whose last columns roll up.
Eigen::Vector3d Curled(const Eigen::Vector3d& p) {
  const double from_mm = kCurlFrom * kCellMm;
  if (p.x() <= from_mm) return p;
  const double angle = (p.x() - from_mm) / kRadiusMm;
  return {from_mm + kRadiusMm * std::sin(angle), p.y(), kRadiusMm * (1 - std::cos(angle))};
}

std::vector<VertexTarget> MeasureUpTo(const std::vector<Eigen::Vector3d>& truth, int columns, double noise_mm,
                                      uint32_t seed) {
  std::vector<VertexTarget> targets =
      Measure(truth, noise_mm, seed, [columns](int v) { return v % kCols < columns; });
  for (VertexTarget& t : targets) t.sigma_mm = std::max(noise_mm, 0.01);
  return targets;
}

class Continuation : public ::testing::Test {
 protected:
  const Template garment_ = SheetTemplate(FlatSheet(kRows, kCols));
  const AlignmentModel model_{garment_};
  const std::vector<Eigen::Vector3d> truth_ = Mapped(garment_.rest.vertices_mm, Curled);
};

TEST_F(Continuation, AnArcGoesOn) {
  const auto continued = ContinueCloth(model_, MeasureUpTo(truth_, kCols - 3, 0, 1), {}, 0.5);
  ASSERT_EQ(continued.size(), static_cast<size_t>(3 * kRows));
  int before = -1;
  double sigma_mm[kCols] = {};
  for (const ContinuedVertex& v : continued) {
    const int column = v.vertex % kCols;
    EXPECT_GT(v.vertex, before);
    before = v.vertex;
    // Straight on, the columns would be off by 0.7, 2.8 and 6.1 mm.
    EXPECT_LT((v.position_mm - truth_[v.vertex]).norm(), 0.4 * (column - kCols + 4)) << column;
    sigma_mm[column] = v.sigma_mm;
  }
  EXPECT_LT(2 * sigma_mm[kCols - 3], sigma_mm[kCols - 2]);
  EXPECT_LT(sigma_mm[kCols - 2], sigma_mm[kCols - 1]);
}

TEST_F(Continuation, HolesAreLeftToTheFill) {
  const auto targets = Measure(truth_, 0, 1, [](int v) {
    return std::abs(v / kCols - kRows / 2) > 2 || std::abs(v % kCols - kCols / 2) > 2;
  });
  EXPECT_TRUE(ContinueCloth(model_, targets, {}, 0.5).empty());
}

TEST_F(Continuation, NoiseMakesItLessSure) {
  const auto sharp = ContinueCloth(model_, MeasureUpTo(truth_, kCols - 1, 0.01, 1), {}, 0.5);
  const auto noisy = ContinueCloth(model_, MeasureUpTo(truth_, kCols - 1, 0.5, 1), {}, 0.5);
  ASSERT_EQ(sharp.size(), static_cast<size_t>(kRows));
  ASSERT_EQ(noisy.size(), sharp.size());
  EXPECT_GT(noisy[7].sigma_mm, 2 * sharp[7].sigma_mm);
}

TEST_F(Continuation, FacesWithoutAreaAndNoTargetsAreNoHarm) {
  TriangleMesh mesh = FlatSheet(kRows, kCols);
  mesh.vertices_mm[kCols - 5] = mesh.vertices_mm[kCols - 6];
  const AlignmentModel model(SheetTemplate(mesh));
  const auto truth = Mapped(mesh.vertices_mm, Curled);
  for (const ContinuedVertex& v : ContinueCloth(model, MeasureUpTo(truth, kCols - 3, 0, 1), {}, 0.5))
    EXPECT_LT((v.position_mm - truth[v.vertex]).norm(), 3);
  EXPECT_TRUE(ContinueCloth(model, {}, {}, 0.5).empty());
  EXPECT_TRUE(ContinueCloth(model, MeasureUpTo(truth, kCols - 3, 0, 1), {.rings = 0}, 0.5).empty());
}

// Through all stages, with noise.
TEST_F(Continuation, ACurledHemIsFollowed) {
  const auto hem = [](int v) { return v % kCols >= kCols - 3; };
  AlignOptions options;
  const auto targets = MeasureUpTo(truth_, kCols - 3, 0.05, 2);
  const auto result = Align(model_, targets, options);
  options.continuation.rings = 0;
  const auto flat = Align(model_, targets, options);
  ASSERT_TRUE(result.ok() && flat.ok());
  EXPECT_LT(MeanError(result->mesh.vertices_mm, truth_, hem),
            0.5 * MeanError(flat->mesh.vertices_mm, truth_, hem));
}

// One frame reads a column more of the hem than the next: what is inferred in both stays where it is.
TEST_F(Continuation, AHemDoesNotJumpWhenAColumnIsLost) {
  const auto change = [&](int rings) {
    AlignOptions options;
    options.continuation.rings = rings;
    const auto now = Align(model_, MeasureUpTo(truth_, kCols - 2, 0.05, 3), options);
    const auto next = Align(model_, MeasureUpTo(truth_, kCols - 3, 0.05, 4), options);
    EXPECT_TRUE(now.ok() && next.ok());
    return MeanError(now->mesh.vertices_mm, next->mesh.vertices_mm,
                     [](int v) { return v % kCols >= kCols - 2; });
  };
  EXPECT_LT(change(3), 0.5 * change(0));
}

}  // namespace
}  // namespace weft
