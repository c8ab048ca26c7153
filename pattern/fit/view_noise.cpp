#include "pattern/fit/view_noise.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/median.h"

namespace weft {

float ModelNoise(float gain, float residual) {
  // Simulated views that are well exposed have gains of 0.9 to 1.2. With 0.6 and 1, three sigma
  // are exceeded by 0.7 and 0.2 % of the coordinates of a quickstart take that is dark beside a white strip,
  // and errors are 0.097 and 0.103 px in the median (November 2026; tests/pattern/dark_view_test.cpp has such
  // views).
  constexpr float kFullGain = 0.75f;
  constexpr float kKept = 4.0f / 9;  // of the variance of pixels, between them
  const float model = kModelNoise * std::clamp(gain / kFullGain, 0.01f, 1.0f);
  const float of_pixels = std::max(residual * residual - model * model, 0.0f) / kKept;
  return std::sqrt(model * model + of_pixels);
}

float ModelNoiseOf(const CellFitter& fitter, const std::vector<PredictedCell>& cells) {
  constexpr size_t kMostCells = 60;
  const size_t step = std::max<size_t>(1, cells.size() / kMostCells);
  std::vector<float> gains, residuals;
  for (size_t k = 0; k < cells.size(); k += step) {
    const CellFit fit = fitter.Fit(cells[k], {.iterations = 2, .min_explained = -1e9f});
    if (!fit.converged) continue;
    gains.push_back(fit.gain);
    residuals.push_back(fit.noise);
  }
  if (gains.empty()) return kModelNoise;
  // Folds leave more than the noise of pixels: the cells that fit best tell what that is.
  constexpr double kFlat = 0.15;
  return ModelNoise(Median(std::move(gains)), Quantile(std::move(residuals), kFlat));
}

}  // namespace weft
