#include "pattern/blurred_profile.h"

#include <cmath>
#include <numbers>

namespace weft {

BlurredProfile::BlurredProfile(double square_fraction)
    : entries_(static_cast<size_t>(kLevels) * (kBins + 1)) {
  const double half = square_fraction / 2;
  for (int level = 0; level < kLevels; ++level) {
    const double sigma = kLeastSigma * std::exp(kLogStep * level);
    const auto edge = [&](double t) { return 0.5 * std::erf(t / (sigma * std::numbers::sqrt2)); };
    const auto density = [&](double t) {
      return std::exp(-t * t / (2 * sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi));
    };
    const auto value = [&](double d) { return static_cast<float>(edge(d + half) - edge(d - half)); };
    const auto slope = [&](double d) { return static_cast<float>(density(d + half) - density(d - half)); };
    for (int bin = 0; bin <= kBins; ++bin) {
      const double d = (bin + 0.5) / kBins - 0.5;
      entries_[static_cast<size_t>(level) * (kBins + 1) + bin] = {
          value(d + 1), value(d), value(d - 1), slope(d + 1), slope(d), slope(d - 1), {0, 0}};
    }
  }
}

const BlurredProfile::Entry* BlurredProfile::Row(float sigma) const {
  const float level = std::log(std::max(sigma, kLeastSigma) / kLeastSigma) / kLogStep;
  return entries_.data() +
         static_cast<size_t>(std::clamp(static_cast<int>(level + 0.5f), 0, kLevels - 1)) * (kBins + 1);
}

}  // namespace weft
