#include "alignment/point_noise.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

// Against the offsets of a flat sheet that was registered to noise, away from its border.
TEST(OffsetVarianceShare, IsThatOfARegisteredSheet) {
  constexpr int kWide = 60, kBorder = 6;
  const Template garment = testing::SheetTemplate(testing::FlatSheet(kWide, kWide));
  for (const double noise_mm : {0.06, 0.15, 0.5}) {
    std::vector<VertexTarget> targets = testing::Measure(garment.rest.vertices_mm, noise_mm, 5);
    for (VertexTarget& t : targets) t.sigma_mm = noise_mm;
    AlignOptions options;
    options.noise_sigmas = 0;
    const auto result = Align(garment, targets, options);
    ASSERT_TRUE(result.ok()) << result.status();
    double sum = 0;
    int count = 0;
    for (const VertexTarget& t : targets) {
      const int row = t.vertex / kWide, column = t.vertex % kWide;
      if (std::min({row, column, kWide - 1 - row, kWide - 1 - column}) < kBorder) continue;
      sum += (result->mesh.vertices_mm[t.vertex] - t.position_mm).squaredNorm();
      count += 3;
    }
    const double measured = sum / count / (noise_mm * noise_mm);
    const double expected = OffsetVarianceShare(targets[0], options);
    EXPECT_GT(measured, 0.6 * expected) << noise_mm;
    EXPECT_LT(measured, 1.4 * expected) << noise_mm;
  }
}

TEST(NoiseInformation, IsThatOfTheCovarianceWithoutFolds) {
  VertexTarget target{.vertex = 0, .sigma_mm = 0.4, .views = 3};
  const DetectionOptions options;
  const double least_mm2 = options.min_sigma_mm * options.min_sigma_mm;
  EXPECT_NEAR(NoiseInformation(target, options)(1, 1), 1 / (0.16 + least_mm2), 1e-9);
  target.covariance_mm2.diagonal() << 0.09, 0.25, 0.04;
  target.fold_covariance_mm2.diagonal() << 0.05, 0, 0;
  const Eigen::Matrix3d information = NoiseInformation(target, options);
  EXPECT_NEAR(information(0, 0), 1 / (0.04 + least_mm2), 1e-9);
  EXPECT_NEAR(information(1, 1), 1 / (0.25 + least_mm2), 1e-9);
  EXPECT_FALSE(HasKnownNoise({.vertex = 0, .views = 3}));
  EXPECT_TRUE(HasKnownNoise(target));
}

}  // namespace
}  // namespace weft
