#include "animation/avatar/sigma_scale.h"

#include <gtest/gtest.h>

#include <array>

namespace weft {
namespace {

TEST(SigmaScale, GrowsWithTheFrameAndWithGrowthWhereNoRayIs) {
  const std::array<float, SigmaScale::kRays> of_rays = {3, 2, 1, 0.5f};
  EXPECT_FLOAT_EQ(SigmaScale::Sigma(of_rays, 1, 10, 4), 20);
  EXPECT_FLOAT_EQ(SigmaScale::Sigma(of_rays, 2, 10, 4), 10);
  EXPECT_FLOAT_EQ(SigmaScale::Sigma(of_rays, 3, 10, 4), 5);
  EXPECT_FLOAT_EQ(SigmaScale::Sigma(of_rays, 12, 10, 4), 5);
  // 3-4-5: one ray's 2 * 8 and the growth's 3 * 4.
  EXPECT_FLOAT_EQ(SigmaScale::Sigma(of_rays, 0, 8, 4), 20);
}

// Another ray never makes a vertex less certain.
TEST(SigmaScale, OfATypicalGarmentFallsWithRays) {
  for (const auto& of_rays : TypicalSigmaScale().of) {
    for (int rays = 2; rays <= 3; ++rays) EXPECT_LE(of_rays[rays], of_rays[rays - 1]);
  }
}

}  // namespace
}  // namespace weft
