#include "pattern/image/ink_model.h"

#include <algorithm>
#include <cmath>

#include "base/median.h"

namespace weft {
namespace {

// Share of the uniform component, and the volume of colours it spreads over.
constexpr float kOutlierShare = 0.01f;
constexpr float kColorVolume = 4.0f;
// Below it an ink is lost in the rounding of the uniform component.
constexpr float kLeastExponent = -24;
// Least standard deviation of an ink, relative to the light.
constexpr double kFloor = 0.03;
constexpr size_t kLeastSamples = 12;

// Index of (a, b), a <= b, in a packed symmetric 3x3 matrix.
constexpr int Packed(int a, int b) { return a == 0 ? b : a + b + 1; }

}  // namespace

InkModel::Ink InkModel::MakeInk(const Rgb& mean, std::array<double, 6> s) {
  for (const int d : {0, 3, 5}) s[d] += kFloor * kFloor;
  const double c00 = s[3] * s[5] - s[4] * s[4], c01 = s[2] * s[4] - s[1] * s[5],
               c02 = s[1] * s[4] - s[2] * s[3];
  const double det = s[0] * c00 + s[1] * c01 + s[2] * c02;
  Ink ink;
  ink.mean = mean;
  const std::array<double, 6> inverse = {
      c00, c01, c02, s[0] * s[5] - s[2] * s[2], s[1] * s[2] - s[0] * s[4], s[0] * s[3] - s[1] * s[1]};
  for (int k = 0; k < 6; ++k) ink.precision[k] = static_cast<float>(inverse[k] / det);
  ink.log_norm = static_cast<float>(-0.5 * std::log(det) - 1.5 * std::log(2 * 3.14159265358979));
  return ink;
}

InkModel InkModel::Faded(float fade, const Rgb& mean) {
  InkModel model;
  std::array<Rgb, kCellColors> colors;
  Rgb average = {};
  for (int k = 0; k < kCellColors; ++k) {
    const auto rgb = CellColorRgb(static_cast<CellColor>(k));
    const float grey = (rgb[0] + rgb[1] + rgb[2]) / (3 * 255.0f);
    for (int c = 0; c < 3; ++c) {
      colors[k][c] = (1 - fade) * rgb[c] / 255.0f + fade * grey;
      average[c] += colors[k][c] / kCellColors;
    }
  }
  for (int k = 0; k < kCellColors; ++k) {
    // Light varies along the colour, everything else is noise.
    std::array<double, 6> covariance = {};
    for (int c = 0; c < 3; ++c) colors[k][c] *= mean[c] / average[c];
    for (int a = 0; a < 3; ++a) {
      for (int b = a; b < 3; ++b) {
        covariance[Packed(a, b)] = 0.04 * colors[k][a] * colors[k][b] + (a == b ? 0.01 : 0.0);
      }
    }
    model.inks_[k] = MakeInk(colors[k], covariance);
  }
  return model;
}

InkModel InkModel::Fitted(const std::vector<InkSample>& samples, const InkModel& before) {
  std::array<std::vector<const Rgb*>, kCellColors> by_ink;
  for (const InkSample& s : samples) by_ink[static_cast<int>(s.label)].push_back(&s.color);
  InkModel model = before;
  for (int k = 0; k < kCellColors; ++k) {
    const auto& colors = by_ink[k];
    if (colors.size() < kLeastSamples) continue;
    // Medians, and the spread around them without the outermost tenth.
    Rgb middle;
    std::vector<float> values(colors.size());
    for (int c = 0; c < 3; ++c) {
      std::transform(colors.begin(), colors.end(), values.begin(), [c](const Rgb* v) { return (*v)[c]; });
      middle[c] = ValueAtRank(values, values.size() / 2);
    }
    const auto distance = [&](const Rgb& v) {
      return std::abs(v[0] - middle[0]) + std::abs(v[1] - middle[1]) + std::abs(v[2] - middle[2]);
    };
    std::transform(colors.begin(), colors.end(), values.begin(), [&](const Rgb* v) { return distance(*v); });
    const float limit = ValueAtRank(values, values.size() * 9 / 10);
    std::array<double, 6> covariance = {};
    std::array<double, 3> sum = {};
    double n = 0;
    for (const Rgb* v : colors) {
      if (distance(*v) > limit) continue;
      ++n;
      for (int a = 0; a < 3; ++a) {
        sum[a] += (*v)[a] - middle[a];
        for (int b = a; b < 3; ++b) {
          covariance[Packed(a, b)] += ((*v)[a] - middle[a]) * static_cast<double>((*v)[b] - middle[b]);
        }
      }
    }
    Rgb mean;
    for (int a = 0; a < 3; ++a) mean[a] = middle[a] + static_cast<float>(sum[a] / n);
    for (int a = 0; a < 3; ++a) {
      for (int b = a; b < 3; ++b) {
        // The cut takes about half of the variance away.
        covariance[Packed(a, b)] = 2.0 * (covariance[Packed(a, b)] / n - sum[a] * sum[b] / (n * n));
      }
    }
    model.inks_[k] = MakeInk(mean, covariance);
  }
  return model;
}

std::array<float, kCellColors> InkModel::Likelihoods(const Rgb& color) const {
  std::array<float, kCellColors> out;
  for (int k = 0; k < kCellColors; ++k) {
    const Ink& ink = inks_[k];
    const float x = color[0] - ink.mean[0], y = color[1] - ink.mean[1], z = color[2] - ink.mean[2];
    const auto& p = ink.precision;
    const float q =
        p[0] * x * x + p[3] * y * y + p[5] * z * z + 2 * (p[1] * x * y + p[2] * x * z + p[4] * y * z);
    const float exponent = ink.log_norm - 0.5f * q;
    out[k] = kOutlierShare / kColorVolume;
    if (exponent > kLeastExponent) out[k] += (1 - kOutlierShare) * std::exp(exponent);
  }
  return out;
}

}  // namespace weft
