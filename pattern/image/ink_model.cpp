#include "pattern/image/ink_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

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

Eigen::Map<const Eigen::Vector3f> AsVector(const Rgb& color) {
  return Eigen::Map<const Eigen::Vector3f>(color.data());
}

}  // namespace

InkModel::Ink InkModel::MakeInk(const Rgb& mean, Eigen::Matrix3d covariance) {
  covariance.diagonal().array() += kFloor * kFloor;
  const double log_norm = -0.5 * std::log(covariance.determinant()) - 1.5 * std::log(2 * std::numbers::pi);
  return {mean, covariance.inverse().cast<float>(), static_cast<float>(log_norm)};
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
    for (int c = 0; c < 3; ++c) colors[k][c] *= mean[c] / average[c];
    const Eigen::Vector3d color = AsVector(colors[k]).cast<double>();
    model.inks_[k] =
        MakeInk(colors[k], 0.04 * color * color.transpose() + 0.01 * Eigen::Matrix3d::Identity());
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
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double n = 0;
    for (const Rgb* v : colors) {
      if (distance(*v) > limit) continue;
      ++n;
      const Eigen::Vector3d off = (AsVector(*v) - AsVector(middle)).cast<double>();
      sum += off;
      squares += off * off.transpose();
    }
    Rgb mean;
    for (int a = 0; a < 3; ++a) mean[a] = middle[a] + static_cast<float>(sum[a] / n);
    // The cut takes about half of the variance away.
    model.inks_[k] = MakeInk(mean, 2.0 * (squares / n - sum * sum.transpose() / (n * n)));
  }
  return model;
}

std::array<float, kCellColors> InkModel::Likelihoods(const Rgb& color) const {
  std::array<float, kCellColors> out;
  for (int k = 0; k < kCellColors; ++k) {
    const Ink& ink = inks_[k];
    const float x = color[0] - ink.mean[0], y = color[1] - ink.mean[1], z = color[2] - ink.mean[2];
    const auto& p = ink.precision;
    const float q = p(0, 0) * x * x + p(1, 1) * y * y + p(2, 2) * z * z +
                    2 * (p(0, 1) * x * y + p(0, 2) * x * z + p(1, 2) * y * z);
    const float exponent = ink.log_norm - 0.5f * q;
    out[k] = kOutlierShare / kColorVolume;
    if (exponent > kLeastExponent) out[k] += (1 - kOutlierShare) * std::exp(exponent);
  }
  return out;
}

}  // namespace weft
