#include "pattern/fit/sampled_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

constexpr int kLevels = 56;
constexpr float kLeastSigma = 0.04f;
constexpr float kLogStep = 0.0677f;

}  // namespace

SampledProfile::SampledProfile(double square_fraction) : along_u_(kLevels), along_v_(kLevels) {
  const double half = square_fraction / 2;
  for (int level = 0; level < kLevels; ++level) {
    const double sigma = kLeastSigma * std::exp(kLogStep * level);
    const auto edge = [&](double t) { return 0.5 * std::erf(t / (sigma * std::numbers::sqrt2)); };
    const auto density = [&](double t) {
      return std::exp(-t * t / (2 * sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi));
    };
    const auto value = [&](double d) { return static_cast<float>(edge(d + half) - edge(d - half)); };
    const auto slope = [&](double d) { return static_cast<float>(density(d + half) - density(d - half)); };
    for (int cell = 0; cell < 5; ++cell) {
      for (int column = 0; column < kCellSide; ++column) {
        const double u = CellSample(column) - (cell - 2);
        along_u_[level].value[cell][column] = value(u);
        along_u_[level].slope[cell][column] = slope(u);
      }
      for (int group = 0; group < kSampleGroups; ++group) {
        for (int lane = 0; lane < kSampleLanes; ++lane) {
          const int row = 2 * group + lane / kCellSide;  // rows lie as columns do
          along_v_[level].value[group][cell][lane] = along_u_[level].value[cell][row];
          along_v_[level].slope[group][cell][lane] = along_u_[level].slope[cell][row];
        }
      }
    }
  }
}

int SampledProfile::Level(float sigma) {
  const float level = std::log(std::max(sigma, kLeastSigma) / kLeastSigma) / kLogStep;
  return std::clamp(static_cast<int>(level + 0.5f), 0, kLevels - 1);
}

}  // namespace weft
