#include "services/results/report/mesh_colors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_format.h"
#include "base/median.h"

namespace weft {
namespace {

float SrgbFromLinear(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  return static_cast<float>(c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

// Oklab to sRGB; colours outside the gamut are clipped.
Eigen::Vector3f SrgbFromOklab(double lightness, double a, double b) {
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  return {SrgbFromLinear(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          SrgbFromLinear(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          SrgbFromLinear(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

}  // namespace

Eigen::Vector3f ClothColor() { return {0.80f, 0.79f, 0.76f}; }

Eigen::Vector3f StateColor(VertexState state) {
  switch (state) {
    case VertexState::kObserved:
      return {0.34f, 0.71f, 0.91f};
    case VertexState::kTwoView:
      return {0.00f, 0.62f, 0.45f};
    case VertexState::kBridged:
      return {0.55f, 0.25f, 0.50f};
    case VertexState::kDriven:
      return {0.94f, 0.89f, 0.26f};
    case VertexState::kInferred:
      break;
  }
  return {0.90f, 0.62f, 0.00f};
}

Eigen::Vector3f UnknownColor() { return {0.55f, 0.55f, 0.55f}; }

Eigen::Vector3f MapColor(double value) {
  const double t = std::clamp(value, 0.0, 1.0);
  const double hue = (285 - 180 * t) * M_PI / 180;
  const double chroma = 0.092 + 0.065 * t * t * t;  // inside sRGB all the way
  return SrgbFromOklab(0.36 + 0.55 * t, chroma * std::cos(hue), chroma * std::sin(hue));
}

Eigen::Vector3f DivergingColor(double value) {
  static const Eigen::Vector3f kLow = Eigen::Vector3f(42, 96, 168) / 255,
                               kMiddle = Eigen::Vector3f(244, 244, 240) / 255,
                               kHigh = Eigen::Vector3f(222, 126, 24) / 255;
  const auto share = static_cast<float>(std::clamp(value, -1.0, 1.0));
  return kMiddle + ((share < 0 ? kLow : kHigh) - kMiddle) * std::abs(share);
}

ScalarRange RoundRange(std::vector<double> values, double share) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return {};
  const double position = std::clamp(share, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const double most = ValueAtRank(values, static_cast<size_t>(std::ceil(position)));
  if (most <= 0) return {};
  const double decade = std::pow(10, std::floor(std::log10(most)));
  for (const double step : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (most <= step * decade * (1 + 1e-6)) return {0, step * decade};
  }
  return {0, 10 * decade};
}

ScalarRange RoundRangeAroundZero(std::vector<double> values, double share) {
  for (double& value : values) value = std::abs(value);
  const double high = RoundRange(std::move(values), share).high;
  return {-high, high};
}

Eigen::Vector3f ScalarColor(double value, const ScalarRange& range) {
  if (!std::isfinite(value)) return UnknownColor();
  if (range.low < 0) return DivergingColor(value / std::max(-range.low, range.high));
  return MapColor((value - range.low) / (range.high > range.low ? range.high - range.low : 1));
}

std::vector<Eigen::Vector3f> PlainColors(size_t vertices) {
  return std::vector<Eigen::Vector3f>(vertices, ClothColor());
}

std::vector<Eigen::Vector3f> StateColors(const std::vector<VertexState>& state) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(state.size());
  for (const VertexState s : state) colors.push_back(StateColor(s));
  return colors;
}

std::vector<Eigen::Vector3f> ScalarColors(const std::vector<double>& values, const ScalarRange& range) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(values.size());
  for (const double value : values) colors.push_back(ScalarColor(value, range));
  return colors;
}

std::string HexColor(const Eigen::Vector3f& color) {
  const auto byte = [&](int channel) {
    return static_cast<unsigned>(std::lround(std::clamp(color[channel], 0.0f, 1.0f) * 255));
  };
  return absl::StrFormat("#%02x%02x%02x", byte(0), byte(1), byte(2));
}

}  // namespace weft
