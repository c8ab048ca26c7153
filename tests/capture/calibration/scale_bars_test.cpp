#include "capture/calibration/scale_bars.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

CalibrationTarget TwoBars() {
  CalibrationTarget target;
  target.scale_bars.resize(2);
  for (ScaleBar& bar : target.scale_bars) bar.length_mm = 1000;
  return target;
}
ScaleBarFit MeasuredBar(int bar, double length_mm, double sigma_mm) {
  ScaleBarFit fit;
  fit.bar = bar, fit.frames = 3, fit.length_mm = length_mm, fit.sigma_mm = sigma_mm;
  return fit;
}

TEST(ScaleFromBars, IsTheMeanOfBarsThatAreEquallySure) {
  // 1 % each: 1000 / 500 and 1000 / 1000.
  const auto scale = ScaleFromBars(TwoBars(), {MeasuredBar(0, 500, 5), MeasuredBar(1, 1000, 10)});
  ASSERT_TRUE(scale.ok());
  EXPECT_NEAR(*scale, 1.5, 1e-12);
}

TEST(ScaleFromBars, CountsAnUnsureBarByTheSquareOfItsSigma) {
  // 1 % and 10 %: weights of 100 to 1.
  const auto scale = ScaleFromBars(TwoBars(), {MeasuredBar(0, 500, 5), MeasuredBar(1, 1000, 100)});
  ASSERT_TRUE(scale.ok());
  EXPECT_NEAR(*scale, (100 * 2.0 + 1 * 1.0) / 101, 1e-12);
}

TEST(ScaleFromBars, NeedsABar) {
  EXPECT_EQ(ScaleFromBars(TwoBars(), {}).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace weft
