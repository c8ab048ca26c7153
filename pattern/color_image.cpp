#include "pattern/color_image.h"

#include <algorithm>
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

Plane Brightness(const ColorImage& image) {
  const int width = image.width_px, height = image.height_px;
  Plane plane;
  plane.width_px = width;
  plane.height_px = height;
  plane.values.resize(static_cast<size_t>(width) * height);
  // Rows of the brightest channel, smoothed along x, for three rows at a time.
  std::vector<float> raw(width);
  std::vector<float> smooth[3];
  for (auto& row : smooth) row.resize(width);
  const auto fill = [&](int y) {
    const uint8_t* in = image.at(0, y);
    for (int x = 0; x < width; ++x) raw[x] = std::max({in[4 * x], in[4 * x + 1], in[4 * x + 2]});
    float* out = smooth[y % 3].data();
    for (int x = 0; x < width; ++x) {
      out[x] = 0.125f * (raw[std::max(0, x - 1)] + raw[std::min(width - 1, x + 1)]) + 0.75f * raw[x];
    }
  };
  fill(0);
  for (int y = 0; y < height; ++y) {
    if (y + 1 < height) fill(y + 1);
    const float* above = smooth[std::max(0, y - 1) % 3].data();
    const float* here = smooth[y % 3].data();
    const float* below = smooth[std::min(height - 1, y + 1) % 3].data();
    float* out = plane.row(y);
    for (int x = 0; x < width; ++x) out[x] = 0.125f * (above[x] + below[x]) + 0.75f * here[x];
  }
  return plane;
}

}  // namespace weft
