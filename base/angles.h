// Angles in radians.
#pragma once

#include <numbers>

namespace weft {

inline constexpr double kTurn = 2 * std::numbers::pi;
inline constexpr double kRadPerDeg = std::numbers::pi / 180;

}  // namespace weft
