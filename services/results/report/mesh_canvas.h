// A depth buffer that triangles are drawn into.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/results/report/mesh_view.h"

namespace weft {

// A vertex as the canvas needs it: sample coordinates, y down; depth, larger is nearer; colours of both
// sides.
struct ScreenVertex {
  double x = 0, y = 0;
  float depth = 0;
  Eigen::Vector3f outside, inside;  // linear light
};

// Depth and colour of the nearest surface at every sample.
class MeshCanvas {
 public:
  // Samples.
  MeshCanvas(int width, int height);

  // A triangle, clipped to the canvas.
  void Draw(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c);

  bool IsHit(int x, int y) const { return depth_[At(x, y)] > kNothing; }
  float Depth(int x, int y) const { return depth_[At(x, y)]; }
  const Eigen::Vector3f& Color(int x, int y) const { return color_[At(x, y)]; }  // linear light

  // Mean of ss x ss samples per pixel.
  MeshView Resolve(int ss, bool transparent) const;

 private:
  static const float kNothing;

  size_t At(int x, int y) const { return static_cast<size_t>(y) * width_ + x; }
  void ResolvePixel(int x0, int y0, int ss, bool transparent, uint8_t* pixel) const;

  int width_, height_;
  std::vector<float> depth_;
  std::vector<Eigen::Vector3f> color_;
};

// sRGB from 0 to 255.
uint8_t SrgbByte(float linear);

}  // namespace weft
