#include "services/results/report/mesh_canvas.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

constexpr double kOnEdge = -1e-9;  // rounding leaves no cracks between neighbours

// Index of the first sample whose centre is not left of `position`.
int FirstSample(double position, int count) {
  return static_cast<int>(std::clamp(std::ceil(position - 0.5), 0.0, static_cast<double>(count)));
}

}  // namespace

const float MeshCanvas::kNothing = -std::numeric_limits<float>::infinity();

uint8_t SrgbByte(float linear) {
  const float c = std::clamp(linear, 0.0f, 1.0f);
  const float s = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<uint8_t>(std::lround(s * 255));
}

MeshCanvas::MeshCanvas(int width, int height)
    : width_(width),
      height_(height),
      depth_(static_cast<size_t>(width) * height, kNothing),
      color_(static_cast<size_t>(width) * height, Eigen::Vector3f::Zero()) {}

void MeshCanvas::Draw(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c) {
  // Twice the signed area; y runs down, so that faces seen from outside come out negative.
  const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (area == 0 || !std::isfinite(area)) return;
  const bool outside = area < 0;
  const int x_begin = FirstSample(std::min({a.x, b.x, c.x}), width_);
  const int x_end = FirstSample(std::max({a.x, b.x, c.x}) + 1, width_);
  const int y_begin = FirstSample(std::min({a.y, b.y, c.y}), height_);
  const int y_end = FirstSample(std::max({a.y, b.y, c.y}) + 1, height_);
  for (int y = y_begin; y < y_end; ++y) {
    for (int x = x_begin; x < x_end; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const double wb = ((px - a.x) * (c.y - a.y) - (py - a.y) * (c.x - a.x)) / area;
      const double wc = ((b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x)) / area;
      const double wa = 1 - wb - wc;
      if (wa < kOnEdge || wb < kOnEdge || wc < kOnEdge) continue;
      const float fa = static_cast<float>(wa), fb = static_cast<float>(wb), fc = static_cast<float>(wc);
      const float depth = fa * a.depth + fb * b.depth + fc * c.depth;
      const size_t at = At(x, y);
      if (!(depth > depth_[at])) continue;
      depth_[at] = depth;
      color_[at] = outside ? Eigen::Vector3f(fa * a.outside + fb * b.outside + fc * c.outside)
                           : Eigen::Vector3f(fa * a.inside + fb * b.inside + fc * c.inside);
    }
  }
}

MeshView MeshCanvas::Resolve(int ss, bool transparent) const {
  MeshView view;
  view.width_px = width_ / ss;
  view.height_px = height_ / ss;
  view.rgba.resize(static_cast<size_t>(view.width_px) * view.height_px * 4, 0);
  for (int y = 0; y < view.height_px; ++y) {
    for (int x = 0; x < view.width_px; ++x) {
      uint8_t* pixel = &view.rgba[(static_cast<size_t>(y) * view.width_px + x) * 4];
      ResolvePixel(x * ss, y * ss, ss, transparent, pixel);
    }
  }
  return view;
}

void MeshCanvas::ResolvePixel(int x0, int y0, int ss, bool transparent, uint8_t* pixel) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int hit = 0;
  for (int y = y0; y < y0 + ss; ++y) {
    for (int x = x0; x < x0 + ss; ++x) {
      if (!IsHit(x, y)) continue;
      sum += Color(x, y);
      ++hit;
    }
  }
  const int all = ss * ss;
  if (!transparent) {
    sum += static_cast<float>(all - hit) * Eigen::Vector3f::Ones();  // white
    hit = all;
  }
  if (hit == 0) return;
  for (int k = 0; k < 3; ++k) pixel[k] = SrgbByte(sum[k] / static_cast<float>(hit));
  pixel[3] = static_cast<uint8_t>((hit * 255 + all / 2) / all);
}

}  // namespace weft
