#include "pattern/color_image.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace weft {

float Plane::Sample(float x, float y) const {
  x = std::clamp(x, 0.0f, static_cast<float>(width_px - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(height_px - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(0, width_px - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, height_px - 2));
  const int x1 = std::min(x0 + 1, width_px - 1);
  const float* top = row(y0);
  const float* bottom = row(std::min(y0 + 1, height_px - 1));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  return (1 - fy) * ((1 - fx) * top[x0] + fx * top[x1]) + fy * ((1 - fx) * bottom[x0] + fx * bottom[x1]);
}

ColorImage ToColorImage(const Frame& rgb) {
  ColorImage image;
  image.width_px = rgb.width_px;
  image.height_px = rgb.height_px;
  const size_t pixels = static_cast<size_t>(rgb.width_px) * rgb.height_px;
  image.rgbx.resize(4 * pixels);
  const uint8_t* in = rgb.pixels->data();
  uint8_t* out = image.rgbx.data();
  for (size_t i = 0; i < pixels; ++i, in += 3, out += 4) {
    out[0] = in[0];
    out[1] = in[1];
    out[2] = in[2];
    out[3] = 0;
  }
  return image;
}

ColorImage HalfSize(const ColorImage& image) {
  ColorImage half;
  half.width_px = image.width_px / 2;
  half.height_px = image.height_px / 2;
  half.rgbx.resize(4 * static_cast<size_t>(half.width_px) * half.height_px);
  for (int y = 0; y < half.height_px; ++y) {
    const uint8_t* top = image.at(0, 2 * y);
    const uint8_t* bottom = image.at(0, 2 * y + 1);
    uint8_t* out = half.rgbx.data() + 4 * static_cast<size_t>(y) * half.width_px;
    for (int x = 0; x < half.width_px; ++x) {
      for (int c = 0; c < 4; ++c) {
        const int sum = top[8 * x + c] + top[8 * x + 4 + c] + bottom[8 * x + c] + bottom[8 * x + 4 + c];
        out[4 * x + c] = static_cast<uint8_t>((sum + 2) / 4);
      }
    }
  }
  return half;
}

int PyramidLevelFor(float edge_px, size_t levels) {
  constexpr float kLongestEdgePx = 7.5f;
  int level = 0;
  for (float longest = kLongestEdgePx; edge_px > longest && level + 1 < static_cast<int>(levels);
       longest *= 2)
    ++level;
  return level;
}

float SigmaInPyramid(float sigma_px, float scale) {
  // Variances of a box and of linear interpolation, the mean over places between two pixels.
  return std::sqrt(sigma_px * sigma_px + (scale * scale - 1) / 12 + scale * scale / 6);
}

namespace {

// Logarithm of the brightest channel; the offset keeps noise in the dark small.
Plane LogBrightness(const ColorImage& image) {
  constexpr float kOffset = 10;
  std::array<float, 256> logs;
  for (int k = 0; k < 256; ++k) logs[k] = std::log(static_cast<float>(k) + kOffset);
  Plane plane{image.width_px, image.height_px, {}};
  plane.values.resize(static_cast<size_t>(image.width_px) * image.height_px);
  const uint8_t* in = image.rgbx.data();
  for (float& v : plane.values) {
    v = logs[std::max({in[0], in[1], in[2]})];
    in += 4;
  }
  return plane;
}

// Weights of offsets 0, 1, 2 ... of a Gaussian.
std::vector<float> GaussianTaps(float sigma_px) {
  const int reach = static_cast<int>(std::ceil(2.5f * sigma_px));
  std::vector<float> taps(reach + 1);
  float sum = 0;
  for (int k = 0; k <= reach; ++k) {
    taps[k] = std::exp(-0.5f * static_cast<float>(k * k) / (sigma_px * sigma_px));
    sum += k == 0 ? taps[k] : 2 * taps[k];
  }
  for (float& t : taps) t /= sum;
  return taps;
}

// Separable; pixels beyond the border repeat it.
Plane Smoothed(const Plane& in, float sigma_px) {
  const std::vector<float> taps = GaussianTaps(sigma_px);
  const int reach = static_cast<int>(taps.size()) - 1, width = in.width_px, height = in.height_px;
  Plane out{width, height, std::vector<float>(in.values.size())};
  std::vector<float> line(width + 2 * reach);
  for (int y = 0; y < height; ++y) {
    float* mid = line.data() + reach;
    for (int x = 0; x < width; ++x) mid[x] = taps[0] * in.row(y)[x];
    for (int k = 1; k <= reach; ++k) {
      const float* above = in.row(std::max(0, y - k));
      const float* below = in.row(std::min(height - 1, y + k));
      const float t = taps[k];
      for (int x = 0; x < width; ++x) mid[x] += t * (above[x] + below[x]);
    }
    for (int k = 1; k <= reach; ++k) {
      mid[-k] = mid[0];
      mid[width - 1 + k] = mid[width - 1];
    }
    float* row = out.row(y);
    for (int x = 0; x < width; ++x) row[x] = taps[0] * mid[x];
    for (int k = 1; k <= reach; ++k) {
      const float t = taps[k];
      for (int x = 0; x < width; ++x) row[x] += t * (mid[x - k] + mid[x + k]);
    }
  }
  return out;
}

}  // namespace

Plane SpotContrast(const ColorImage& image, float surround_px) {
  const Plane logs = LogBrightness(image);
  Plane spots = Smoothed(logs, 0.5f);
  const Plane surround = Smoothed(logs, surround_px);
  for (size_t k = 0; k < spots.values.size(); ++k) spots.values[k] -= surround.values[k];
  return spots;
}

}  // namespace weft
