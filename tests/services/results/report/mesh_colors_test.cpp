#include "services/results/report/mesh_colors.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace weft {
namespace {

// Lightness of an sRGB colour in Oklab (Ottosson 2020).
double OklabLightness(const Eigen::Vector3f& srgb) {
  Eigen::Vector3d linear;
  for (int k = 0; k < 3; ++k)
    linear[k] = srgb[k] <= 0.04045 ? srgb[k] / 12.92 : std::pow((srgb[k] + 0.055) / 1.055, 2.4);
  Eigen::Matrix3d lms_from_rgb;
  lms_from_rgb << 0.4122214708, 0.5363325363, 0.0514459929, 0.2119034982, 0.6806995451, 0.1073969566,
      0.0883024619, 0.2817188376, 0.6299787005;
  const Eigen::Vector3d lms = lms_from_rgb * linear;
  return 0.2104542553 * std::cbrt(lms[0]) + 0.7936177850 * std::cbrt(lms[1]) -
         0.0040720468 * std::cbrt(lms[2]);
}

TEST(MeshColors, LightnessRisesEvenly) {
  const double dark = OklabLightness(MapColor(0)), light = OklabLightness(MapColor(1));
  EXPECT_GT(light - dark, 0.5);
  for (const double value : {0.25, 0.5, 0.75})
    EXPECT_NEAR(OklabLightness(MapColor(value)), dark + (light - dark) * value, 0.005);
  EXPECT_EQ(MapColor(-3), MapColor(0));
  EXPECT_EQ(MapColor(7), MapColor(1));
}

TEST(MeshColors, DifferencesAreNearlyWhiteInTheMiddle) {
  EXPECT_EQ(HexColor(DivergingColor(0)), "#f4f4f0");
  EXPECT_GT(DivergingColor(-1).z(), DivergingColor(-1).x());  // blue
  EXPECT_GT(DivergingColor(1).x(), DivergingColor(1).z());    // orange
  EXPECT_EQ(DivergingColor(-5), DivergingColor(-1));
}

TEST(MeshColors, ScalesEndAtRoundNumbers) {
  EXPECT_DOUBLE_EQ(RoundRange({0.42}).high, 0.5);
  EXPECT_DOUBLE_EQ(RoundRange({9.1}).high, 10);
  EXPECT_DOUBLE_EQ(RoundRange({2, std::nan(""), std::numeric_limits<double>::infinity()}).high, 2);
  std::vector<double> values(99, 1.0);
  values.push_back(1000);
  EXPECT_DOUBLE_EQ(RoundRange(values).high, 1);
  EXPECT_DOUBLE_EQ(RoundRange(values, 1).high, 1000);
}

TEST(MeshColors, WithoutValuesTheScaleEndsAtOne) {
  EXPECT_DOUBLE_EQ(RoundRange({}).high, 1);
  EXPECT_DOUBLE_EQ(RoundRange({std::nan("")}).high, 1);
  EXPECT_DOUBLE_EQ(RoundRange({0, 0}).high, 1);
}

TEST(MeshColors, ScalesOfDifferencesReachAsFarBothWays) {
  const ScalarRange range = RoundRangeAroundZero({-3, 1});
  EXPECT_DOUBLE_EQ(range.low, -3);
  EXPECT_DOUBLE_EQ(range.high, 3);
}

TEST(MeshColors, WhatIsNoNumberIsGrey) {
  EXPECT_EQ(ScalarColor(std::nan(""), {0, 1}), UnknownColor());
  EXPECT_EQ(ScalarColor(5, {0, 10}), MapColor(0.5));
  EXPECT_EQ(ScalarColor(-2, {-4, 4}), DivergingColor(-0.5));
  EXPECT_EQ(ScalarColor(3, {3, 3}), MapColor(0));
}

TEST(MeshColors, HexadecimalColoursAreClamped) { EXPECT_EQ(HexColor({-1, 0.2f, 2}), "#0033ff"); }

// Colours of pages that were written before; each as it stands on them.
TEST(MeshColors, ColoursStay) {
  std::string map;
  for (int i = 0; i <= 8; ++i) map += HexColor(MapColor(i / 8.0)) + " ";
  EXPECT_EQ(map, R"(#39346b #334e82 #276992 #19839b #259d9d #4ab598 #7acb8c #b2dc78 #f1e75c )");
  std::string diverging;
  for (const double value : {-1.0, -0.5, 0.0, 0.25, 1.0}) diverging += HexColor(DivergingColor(value)) + " ";
  EXPECT_EQ(diverging, "#2a60a8 #8faacc #f4f4f0 #efd7ba #de7e18 ");
  std::string states;
  for (int state = 0; state < 5; ++state)
    states += HexColor(StateColor(static_cast<VertexState>(state))) + " ";
  EXPECT_EQ(states, "#e69e00 #57b5e8 #009e73 #8c4080 #f0e342 ");
  EXPECT_EQ(HexColor(UnknownColor()), "#8c8c8c");
  EXPECT_EQ(HexColor(ClothColor()), "#ccc9c2");
  EXPECT_EQ(PlainColors(2), (std::vector<Eigen::Vector3f>{ClothColor(), ClothColor()}));
  EXPECT_EQ(StateColors({VertexState::kTwoView}),
            (std::vector<Eigen::Vector3f>{StateColor(VertexState::kTwoView)}));
}

TEST(MeshColors, EachRoundNumberEndsAScale) {
  std::string ends;
  for (const double most :
       {0.1, 0.101, 0.15, 0.16, 0.2, 0.21, 0.31, 0.41, 0.51, 0.61, 0.81, 1000.0, 1000.002})
    ends += std::to_string(RoundRange({most}).high) + " ";
  EXPECT_EQ(
      ends,
      "0.100000 0.150000 0.150000 0.200000 0.200000 0.300000 0.400000 0.500000 0.600000 0.800000 1.000000 "
      "1000.000000 1500.000000 ");
  EXPECT_EQ(RoundRange({1, 2, 3, 4, 5}, 0.5).high, 3);
  EXPECT_EQ(RoundRange({1, 2, 3, 4, 5}, 0.51).high, 4) << "the next one";
  EXPECT_EQ(RoundRange({1, 2, 3, 4, 5}, 0).high, 1);
  EXPECT_EQ(RoundRange({0.1, 0.2}).low, 0);
  EXPECT_EQ(ScalarColor(1, {-1, 4}), DivergingColor(0.25)) << "the farther end";
}

}  // namespace
}  // namespace weft
