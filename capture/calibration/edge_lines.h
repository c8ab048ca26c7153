// Sides of a dark or bright square in an image, to a small part of a pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace weft {

// Light, [height][width].
struct LightImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> values;
};

// Of a side's length that is left out at each end.
inline constexpr double kCornerShare = 0.12;
// Sides from this length on are fitted as parabolas, shorter ones as straight lines: a parabola between so
// few steps would double the noise of the corners.
inline constexpr double kBendsFromPx = 80;

struct SquareOptions {
  int modules = 8;  // of the printed grid across the square; steps are looked for within half of one
  bool bright_outside = true;
  double min_contrast = 20;
};

struct SharpSquare {
  std::array<Eigen::Vector2d, 4> corners_px;  // in the order of the rough ones
  double blur_px = 0;                         // standard deviation of the softest side's brightness steps
  double blur_limit_px = 0;  // what a ramp without end would give: a blur close to this may be any larger one
};

// From corners that are right to half a module, in clockwise order. Each side is a straight line, from
// kBendsFromPx on a parabola, through the centres of the brightness steps across it. Empty where a side shows
// no clear step along most of its length.
std::optional<SharpSquare> SharpenSquare(const LightImage& image,
                                         const std::array<Eigen::Vector2d, 4>& rough_px,
                                         const SquareOptions& options);

}  // namespace weft
