// Colours of vertices: plain cloth, by state, by a scalar.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

// sRGB from 0 to 1. Observed is blue and inferred orange, which colour-blind readers tell apart.
Eigen::Vector3f ClothColor();
Eigen::Vector3f StateColor(VertexState state);
Eigen::Vector3f UnknownColor();  // of values that are not numbers

// Dark blue over green to light yellow with evenly rising lightness (Oklab, Ottosson 2020). Values outside
// [0, 1] get the end's colour.
Eigen::Vector3f MapColor(double value);

// Low and high end of a colour scale.
struct ScalarRange {
  double low = 0;
  double high = 1;
};
// From 0 to a round number that at least `share` of the values do not exceed; {0, 1} when there are none.
// Values that are not finite do not count.
ScalarRange RoundRange(std::vector<double> values, double share = 0.98);

std::vector<Eigen::Vector3f> PlainColors(size_t vertices);
std::vector<Eigen::Vector3f> StateColors(const std::vector<VertexState>& state);
std::vector<Eigen::Vector3f> ScalarColors(const std::vector<double>& values, const ScalarRange& range);

// "#rrggbb".
std::string HexColor(const Eigen::Vector3f& color);

}  // namespace weft
