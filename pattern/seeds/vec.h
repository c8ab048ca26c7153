// Points and edges of lattices in an image.
#pragma once

#include <cmath>

namespace weft {

// In px.
struct Vec {
  float x = 0, y = 0;
  friend Vec operator+(Vec p, Vec q) { return {p.x + q.x, p.y + q.y}; }
  friend Vec operator-(Vec p, Vec q) { return {p.x - q.x, p.y - q.y}; }
  friend Vec operator*(float s, Vec p) { return {s * p.x, s * p.y}; }
};
inline float Dot(Vec p, Vec q) { return p.x * q.x + p.y * q.y; }
inline float Cross(Vec p, Vec q) { return p.x * q.y - p.y * q.x; }
inline float Length(Vec p) { return std::sqrt(Dot(p, p)); }

}  // namespace weft
