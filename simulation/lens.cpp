#include "simulation/lens.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr double kRadiusStepPx = 0.5;
constexpr double kMaxRadiusPx = 40;

std::vector<float> GaussianKernel(double sigma_px) {
  const int radius = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<double> weights(2 * radius + 1);
  double sum = 0;
  for (int i = -radius; i <= radius; ++i)
    sum += weights[i + radius] = std::exp(-0.5 * i * i / (sigma_px * sigma_px));
  std::vector<float> out;
  out.reserve(weights.size());
  for (const double w : weights) out.push_back(static_cast<float>(w / sum));
  return out;
}

// Adds `weight` times the row of `in` at y + dy, shifted by dx, to `row`.
void AddRow(const LinearImage& in, int y, int dy, int dx, float weight, float* row) {
  const float* const source = in.at(0, std::clamp(y + dy, 0, in.height_px - 1));
  const int begin = std::clamp(-dx, 0, in.width_px);
  const int end = std::clamp(in.width_px - dx, begin, in.width_px);
  const auto add = [&](int x, int from) {
    for (int i = 0; i < 3; ++i) row[3 * x + i] += weight * source[3 * from + i];
  };
  for (int x = 0; x < begin; ++x) add(x, 0);
  for (int i = 3 * begin; i < 3 * end; ++i) row[i] += weight * source[i + 3 * dx];
  for (int x = end; x < in.width_px; ++x) add(x, in.width_px - 1);
}

struct Tap {
  int dx = 0, dy = 0;
  float weight = 0;
};

LinearImage Filter(const LinearImage& in, const std::vector<Tap>& taps) {
  LinearImage out{in.width_px, in.height_px, std::vector<float>(in.rgb.size(), 0.0f)};
  tbb::parallel_for(tbb::blocked_range<int>(0, in.height_px), [&](const auto& range) {
    for (int y = range.begin(); y < range.end(); ++y)
      for (const Tap& tap : taps) AddRow(in, y, tap.dy, tap.dx, tap.weight, out.at(0, y));
  });
  return out;
}

// Weights of the pixels by their area within the disc, from 16 x 16 points each.
std::vector<Tap> DiscTaps(double radius_px) {
  constexpr int kPoints = 16;
  const int reach = static_cast<int>(std::ceil(radius_px + 0.5));
  std::vector<Tap> taps;
  float sum = 0;
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      int inside = 0;
      for (int k = 0; k < kPoints * kPoints; ++k) {
        const double x = dx - 0.5 + (k % kPoints + 0.5) / kPoints;
        const double y = dy - 0.5 + (k / kPoints + 0.5) / kPoints;
        inside += x * x + y * y <= radius_px * radius_px ? 1 : 0;
      }
      if (inside == 0) continue;
      taps.push_back({dx, dy, static_cast<float>(inside)});
      sum += static_cast<float>(inside);
    }
  for (Tap& tap : taps) tap.weight /= sum;
  return taps;
}

}  // namespace

absl::Status LensOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* expected) {
    return absl::InvalidArgumentError(absl::StrCat("lens: ", field, " is ", value, ", expected ", expected));
  };
  if (!(point_spread_sigma_px >= 0 && point_spread_sigma_px <= 50))
    return bad("point_spread_sigma_px", point_spread_sigma_px, "0 to 50");
  if (!(point_spread_variation >= 0 && point_spread_variation < 1))
    return bad("point_spread_variation", point_spread_variation, "0 to 1");
  if (!(f_number == 0 || (f_number >= 0.5 && f_number <= 64)))
    return bad("f_number", f_number, "0.5 to 64, or 0 for a pinhole");
  if (!(focus_distance_mm >= 0)) return bad("focus_distance_mm", focus_distance_mm, "0 or more");
  if (!(focus_error_mm >= 0)) return bad("focus_error_mm", focus_error_mm, "0 or more");
  if (!(pixel_pitch_um > 0)) return bad("pixel_pitch_um", pixel_pitch_um, "a positive number");
  if (!(vignetting >= 0 && vignetting < 1)) return bad("vignetting", vignetting, "0 to 1");
  return absl::OkStatus();
}

double DefocusRadiusPx(const LensOptions& options, double focal_px, double focus_mm, double depth_mm) {
  if (options.f_number == 0 || !(depth_mm > 0)) return 0;
  const double pitch_mm = options.pixel_pitch_um / 1000;
  const double focal_mm = focal_px * pitch_mm;
  if (!(focus_mm > focal_mm)) return 0;
  const double diameter_mm = focal_mm * focal_mm * std::abs(depth_mm - focus_mm) /
                             (options.f_number * depth_mm * (focus_mm - focal_mm));
  return std::min(diameter_mm / 2 / pitch_mm, kMaxRadiusPx);
}

void BlurGaussian(double sigma_px, LinearImage* image) {
  if (!(sigma_px > 0)) return;
  const std::vector<float> kernel = GaussianKernel(sigma_px);
  const int radius = static_cast<int>(kernel.size() / 2);
  std::vector<Tap> across, down;
  for (int t = -radius; t <= radius; ++t) {
    across.push_back({t, 0, kernel[t + radius]});
    down.push_back({0, t, kernel[t + radius]});
  }
  *image = Filter(Filter(*image, across), down);
}

void BlurDefocus(const std::vector<float>& radius_px, LinearImage* image) {
  const size_t pixels = radius_px.size();
  const auto level_of = [&](size_t p) { return static_cast<int>(radius_px[p] / kRadiusStepPx); };
  int most = 0;
  for (size_t p = 0; p < pixels; ++p) most = std::max(most, level_of(p));
  std::vector<char> needed(static_cast<size_t>(most) + 2, 0);
  for (size_t p = 0; p < pixels; ++p) needed[level_of(p)] = needed[level_of(p) + 1] = 1;
  LinearImage out{image->width_px, image->height_px, std::vector<float>(image->rgb.size(), 0.0f)};
  for (int level = 0; level < static_cast<int>(needed.size()); ++level) {
    if (needed[level] == 0) continue;
    const LinearImage blurred = level == 0 ? *image : Filter(*image, DiscTaps(level * kRadiusStepPx));
    tbb::parallel_for(tbb::blocked_range<size_t>(0, pixels, 4096), [&](const auto& range) {
      for (size_t p = range.begin(); p < range.end(); ++p) {
        const auto away = static_cast<float>(std::abs(radius_px[p] / kRadiusStepPx - level));
        if (away >= 1) continue;
        for (size_t i = 3 * p; i < 3 * p + 3; ++i) out.rgb[i] += (1 - away) * blurred.rgb[i];
      }
    });
  }
  *image = std::move(out);
}

void Vignette(double share, LinearImage* image) {
  if (!(share > 0)) return;
  const double cx = (image->width_px - 1) / 2.0, cy = (image->height_px - 1) / 2.0;
  const double corner = std::max(cx * cx + cy * cy, 1e-9);
  tbb::parallel_for(tbb::blocked_range<int>(0, image->height_px), [&](const auto& range) {
    for (int y = range.begin(); y < range.end(); ++y)
      for (int x = 0; x < image->width_px; ++x) {
        const double r2 = (x - cx) * (x - cx) + (y - cy) * (y - cy);
        const auto left = static_cast<float>(1 - share * r2 / corner);
        for (int i = 0; i < 3; ++i) image->at(x, y)[i] *= left;
      }
  });
}

}  // namespace weft
