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

constexpr int kCurlRows = 24, kCurlCols = 40, kCurlFrom = 30;
constexpr double kCurlRadiusMm = 5;  // 31 degrees a cell

// A flat sheet whose last columns roll up.
Eigen::Vector3d Curled(const Eigen::Vector3d& p) {
  const double from_mm = kCurlFrom * kCellMm;
  if (p.x() <= from_mm) return p;
  const double angle = (p.x() - from_mm) / kCurlRadiusMm;
  return {from_mm + kCurlRadiusMm * std::sin(angle), p.y(), kCurlRadiusMm * (1 - std::cos(angle))};
}

std::vector<VertexTarget> MeasureUpTo(const std::vector<Eigen::Vector3d>& truth, int columns, double noise_mm,
                                      uint32_t seed) {
  std::vector<VertexTarget> targets =
      Measure(truth, noise_mm, seed, [columns](int v) { return v % kCurlCols < columns; });
  for (VertexTarget& t : targets) t.sigma_mm = std::max(noise_mm, 0.01);
  return targets;
}

class Continuation : public ::testing::Test {
 protected:
  const Template garment_ = SheetTemplate(FlatSheet(kCurlRows, kCurlCols));
  const AlignmentModel model_{garment_};
  const std::vector<Eigen::Vector3d> truth_ = Mapped(garment_.rest.vertices_mm, Curled);
};

TEST_F(Continuation, AnArcGoesOn) {
  const auto continued = ContinueCloth(model_, MeasureUpTo(truth_, kCurlCols - 3, 0, 1), {}, 0.5);
  ASSERT_EQ(continued.size(), static_cast<size_t>(3 * kCurlRows));
  int before = -1;
  double sigma_mm[kCurlCols] = {};
  for (const ContinuedVertex& v : continued) {
    const int column = v.vertex % kCurlCols;
    EXPECT_GT(v.vertex, before);
    before = v.vertex;
    // Straight on, the columns would be off by 0.7, 2.8 and 6.1 mm.
    EXPECT_LT((v.position_mm - truth_[v.vertex]).norm(), 0.4 * (column - kCurlCols + 4)) << column;
    sigma_mm[column] = v.sigma_mm;
  }
  EXPECT_LT(2 * sigma_mm[kCurlCols - 3], sigma_mm[kCurlCols - 2]);
  EXPECT_LT(sigma_mm[kCurlCols - 2], sigma_mm[kCurlCols - 1]);
}

TEST_F(Continuation, HolesAreLeftToTheFill) {
  const auto targets = Measure(truth_, 0, 1, [](int v) {
    return std::abs(v / kCurlCols - kCurlRows / 2) > 2 || std::abs(v % kCurlCols - kCurlCols / 2) > 2;
  });
  EXPECT_TRUE(ContinueCloth(model_, targets, {}, 0.5).empty());
}

TEST_F(Continuation, NoiseMakesItLessSure) {
  const auto sharp = ContinueCloth(model_, MeasureUpTo(truth_, kCurlCols - 1, 0.01, 1), {}, 0.5);
  const auto noisy = ContinueCloth(model_, MeasureUpTo(truth_, kCurlCols - 1, 0.5, 1), {}, 0.5);
  ASSERT_EQ(sharp.size(), static_cast<size_t>(kCurlRows));
  ASSERT_EQ(noisy.size(), sharp.size());
  EXPECT_GT(noisy[7].sigma_mm, 2 * sharp[7].sigma_mm);
}

TEST_F(Continuation, FacesWithoutAreaAndNoTargetsAreNoHarm) {
  TriangleMesh mesh = FlatSheet(kCurlRows, kCurlCols);
  mesh.vertices_mm[kCurlCols - 5] = mesh.vertices_mm[kCurlCols - 6];
  const AlignmentModel model(SheetTemplate(mesh));
  const auto truth = Mapped(mesh.vertices_mm, Curled);
  for (const ContinuedVertex& v : ContinueCloth(model, MeasureUpTo(truth, kCurlCols - 3, 0, 1), {}, 0.5))
    EXPECT_LT((v.position_mm - truth[v.vertex]).norm(), 3);
  EXPECT_TRUE(ContinueCloth(model, {}, {}, 0.5).empty());
  EXPECT_TRUE(ContinueCloth(model, MeasureUpTo(truth, kCurlCols - 3, 0, 1), {.rings = 0}, 0.5).empty());
}

// Through all stages, with noise.
TEST_F(Continuation, ACurledHemIsFollowed) {
  const auto hem = [](int v) { return v % kCurlCols >= kCurlCols - 3; };
  AlignOptions options;
  const auto targets = MeasureUpTo(truth_, kCurlCols - 3, 0.05, 2);
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
    const auto now = Align(model_, MeasureUpTo(truth_, kCurlCols - 2, 0.05, 3), options);
    const auto next = Align(model_, MeasureUpTo(truth_, kCurlCols - 3, 0.05, 4), options);
    EXPECT_TRUE(now.ok() && next.ok());
    return MeanError(now->mesh.vertices_mm, next->mesh.vertices_mm,
                     [](int v) { return v % kCurlCols >= kCurlCols - 2; });
  };
  EXPECT_LT(change(3), 0.5 * change(0));
}

}  // namespace
}  // namespace weft
