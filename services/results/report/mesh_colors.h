// Colours of vertices: plain cloth, by state, by a scalar.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// sRGB from 0 to 1. Blue, green and orange of Okabe and Ito (2008) and a dark purple: at least 0.11 apart in
// Oklab also for protanopes, deuteranopes and tritanopes (Machado et al. 2009).
Eigen::Vector3f ClothColor();
Eigen::Vector3f StateColor(VertexState state);
Eigen::Vector3f UnknownColor();  // of values that are not numbers

// Dark blue over green to light yellow with evenly rising lightness (Oklab, Ottosson 2020). Values outside
// [0, 1] get the end's colour.
Eigen::Vector3f MapColor(double value);

// Blue over nearly white to orange for values from -1 to 1 around 0, which the colour-blind tell apart;
// values outside get the end's colour.
Eigen::Vector3f DivergingColor(double value);

// Low and high end of a colour scale.
struct ScalarRange {
  double low = 0;
  double high = 1;
};
// From 0 to a round number that at least `share` of the values do not exceed; {0, 1} when there are none.
// Values that are not finite do not count.
ScalarRange RoundRange(std::vector<double> values, double share = 0.98);

// From minus to plus such a number, of the values without their signs.
ScalarRange RoundRangeAroundZero(std::vector<double> values, double share = 0.98);

std::vector<Eigen::Vector3f> PlainColors(size_t vertices);
std::vector<Eigen::Vector3f> StateColors(const std::vector<VertexState>& state);
// By MapColor; by DivergingColor where the range has a low end below 0, of which 0 is the middle then.
std::vector<Eigen::Vector3f> ScalarColors(const std::vector<double>& values, const ScalarRange& range);
// The colour of one value on such a scale.
Eigen::Vector3f ScalarColor(double value, const ScalarRange& range);

// "#rrggbb".
std::string HexColor(const Eigen::Vector3f& color);

}  // namespace weft
