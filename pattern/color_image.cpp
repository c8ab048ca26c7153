#include "pattern/color_image.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pattern/cell_kernel.h"

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

// Logarithms of the brightest channel along a row; the offset keeps noise in the dark small.
class LogBrightness {
 public:
  LogBrightness() {
    constexpr float kOffset = 10;
    for (int k = 0; k < 256; ++k) logs_[k] = std::log(static_cast<float>(k) + kOffset);
  }
  void Row(const uint8_t* rgbx, int width_px, float* out) const {
    for (int x = 0; x < width_px; ++x, rgbx += 4) out[x] = logs_[std::max({rgbx[0], rgbx[1], rgbx[2]})];
  }

 private:
  std::array<float, 256> logs_;
};

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

}  // namespace

Plane SpotContrast(const ColorImage& image, float surround_px) {
  const std::vector<float> narrow = GaussianTaps(0.5f), wide = GaussianTaps(surround_px);
  const int narrow_reach = static_cast<int>(narrow.size()) - 1, reach = static_cast<int>(wide.size()) - 1;
  const int width = image.width_px, height = image.height_px, most = std::max(reach, narrow_reach);
  const LogBrightness brightness;
  const CellKernels& kernels = BestCellKernels();
  // The rows around the current one, by y modulo their number, stay in the cache.
  const int kept = 2 * most + 1;
  std::vector<float> ring(static_cast<size_t>(kept) * width), scratch(width + 2 * most), surround(width);
  std::vector<const float*> rows(kept);
  const auto row_at = [&](int y) { return ring.data() + static_cast<size_t>(y % kept) * width; };
  Plane spots{width, height, std::vector<float>(static_cast<size_t>(width) * height)};
  int read = 0;
  for (int y = 0; y < height; ++y) {
    for (; read < std::min(height, y + most + 1); ++read)
      brightness.Row(image.at(0, read), width, row_at(read));
    for (int k = -most; k <= most; ++k) rows[most + k] = row_at(std::clamp(y + k, 0, height - 1));
    float* out = spots.row(y);
    kernels.smooth_row(&rows[most - narrow_reach], narrow.data(), narrow_reach, width, scratch.data(), out);
    kernels.smooth_row(&rows[most - reach], wide.data(), reach, width, scratch.data(), surround.data());
    for (int x = 0; x < width; ++x) out[x] -= surround[x];
  }
  return spots;
}

}  // namespace weft
