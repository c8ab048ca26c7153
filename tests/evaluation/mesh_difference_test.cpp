#include "evaluation/mesh_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace weft {
namespace {

using Positions = std::vector<Eigen::Vector3d>;

TEST(MeshDifference, DistanceIsInMillimetresAndInSigmasOfBoth) {
  const Positions a = {{0, 0, 0}, {10, 0, 0}, {1, 2, 3}}, b = {{3, 4, 0}, {10, 0, 0.5}, {NAN, 0, 0}};
  const MeshDifference difference = DifferenceOf(a, b, {0.6, 0, 0.1}, {0.8, 0.1, 0.1});
  EXPECT_DOUBLE_EQ(difference.distance_mm[0], 5);
  EXPECT_DOUBLE_EQ(difference.distance_sigmas[0], 5);
  EXPECT_DOUBLE_EQ(difference.distance_mm[1], 0.5);
  EXPECT_TRUE(std::isnan(difference.distance_sigmas[1]));  // a sigma of 0 is not known
  EXPECT_TRUE(std::isnan(difference.distance_mm[2]));
  EXPECT_TRUE(std::isnan(difference.distance_sigmas[2]));
  EXPECT_TRUE(DifferenceOf(a, b, {}, {0.8, 0.1, 0.1}).distance_sigmas.empty());
}

// What the header says of noise: 1 % of equal surfaces lies beyond the limit.
TEST(MeshDifference, NoiseOfTheSigmasIsBeyondThemInOnePercent) {
  constexpr size_t kVertices = 200'000;
  constexpr double kSigmaA = 0.3, kSigmaB = 0.1;
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  const auto around_zero = [&](double sigma) {
    Positions out;
    for (size_t v = 0; v < kVertices; ++v)
      out.emplace_back(sigma * noise(random), sigma * noise(random), sigma * noise(random));
    return out;
  };
  const Positions a = around_zero(kSigmaA), b = around_zero(kSigmaB);
  const MeshDifference difference =
      DifferenceOf(a, b, std::vector<double>(kVertices, kSigmaA), std::vector<double>(kVertices, kSigmaB));
  EXPECT_NEAR(ShareBeyondSigmas(difference.distance_sigmas), 0.01, 0.001);
  EXPECT_TRUE(std::isnan(ShareBeyondSigmas({})));
}

}  // namespace
}  // namespace weft
