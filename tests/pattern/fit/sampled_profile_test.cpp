#include "pattern/fit/sampled_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

// The square of one cell, at `x` pitches from its middle, convolved with a Gaussian: the sum of thin slices.
double Blurred(double x, double square_fraction, double sigma) {
  constexpr int kSlices = 4000;
  const double half = square_fraction / 2, step = square_fraction / kSlices;
  double sum = 0;
  for (int k = 0; k < kSlices; ++k) {
    const double t = x - (-half + (k + 0.5) * step);
    sum += std::exp(-t * t / (2 * sigma * sigma));
  }
  return sum * step / (sigma * std::sqrt(2 * M_PI));
}

// Blurs of the table nearest to the given ones.
double Tabulated(double sigma) {
  constexpr double kLeast = 0.04, kLogStep = 0.0677;
  return kLeast * std::exp(kLogStep * std::round(std::log(sigma / kLeast) / kLogStep));
}

TEST(SampledProfile, IsTheSquareConvolvedWithAGaussian) {
  for (const double square : {0.6, 0.75, 0.9}) {
    const SampledProfile profile(square);
    for (const double wanted : {0.04, 0.11, 0.2, 0.45, 1.1}) {
      const double sigma = Tabulated(wanted), h = 1e-4;
      const ProfileAlongU& along_u = profile.AlongU(static_cast<float>(sigma));
      for (int cell = 0; cell < 5; ++cell) {
        for (int k = 0; k < kCellSide; ++k) {
          const double x = CellSample(k) - (cell - 2);
          EXPECT_NEAR(along_u.value[cell][k], Blurred(x, square, sigma), 1e-5) << sigma << " at " << x;
          const double slope = (Blurred(x + h, square, sigma) - Blurred(x - h, square, sigma)) / (2 * h);
          EXPECT_NEAR(along_u.slope[cell][k], slope, 1e-4 / sigma) << sigma << " at " << x;
        }
      }
    }
  }
}

TEST(SampledProfile, RowsHaveTheSameProfileAsColumns) {
  const SampledProfile profile(0.75);
  for (const float sigma : {0.05f, 0.2f, 0.7f}) {
    const ProfileAlongU& along_u = profile.AlongU(sigma);
    const ProfileAlongV& along_v = profile.AlongV(sigma);
    for (int k = 0; k < kCellSide * kCellSide; ++k) {
      const int row = k / kCellSide, group = k / kSampleLanes, lane = k % kSampleLanes;
      for (int cell = 0; cell < 5; ++cell) {
        EXPECT_EQ(along_v.value[group][cell][lane], along_u.value[cell][row]);
        EXPECT_EQ(along_v.slope[group][cell][lane], along_u.slope[cell][row]);
      }
    }
  }
}

TEST(SampledProfile, AnyBlurIsWithinAStepOfTheTable) {
  const SampledProfile profile(0.75);
  for (double sigma = 0.045; sigma < 1.6; sigma *= 1.021) {
    const ProfileAlongU& along_u = profile.AlongU(static_cast<float>(sigma));
    for (int k = 0; k < kCellSide; ++k) {
      const double x = CellSample(k);
      // The table's blurs are 7 % apart.
      const double low = Blurred(x, 0.75, sigma * 0.966), high = Blurred(x, 0.75, sigma * 1.035);
      EXPECT_GE(along_u.value[2][k], std::min(low, high) - 2e-3) << sigma;
      EXPECT_LE(along_u.value[2][k], std::max(low, high) + 2e-3) << sigma;
    }
  }
}

TEST(SampledProfile, BlursBeyondTheTableAreClamped) {
  const SampledProfile profile(0.75);
  EXPECT_EQ(&profile.AlongU(0.0f), &profile.AlongU(0.04f));
  EXPECT_EQ(&profile.AlongU(9.0f), &profile.AlongU(1.66f));
  EXPECT_NE(&profile.AlongU(0.04f), &profile.AlongU(0.05f));
  EXPECT_NE(&profile.AlongV(1.4f), &profile.AlongV(1.65f));
}

}  // namespace
}  // namespace weft
