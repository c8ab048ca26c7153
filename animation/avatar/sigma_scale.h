// Sigma of driven vertices: its factors, what they make of known errors, and what nets gain.
#pragma once

#include <array>

namespace weft {

// What the sigma of a driven vertex is made of: factors by the number of cameras with rays (1, 2, 3, 4 and
// more) and by the vertex's own rays. With 1, 2, 3 and more they multiply RayDrivenFrame::scale_mm. A vertex
// without a ray is off as one with one ray, and in quadrature by the factor for 0 times growth_mm.
struct SigmaScale {
  static constexpr int kCameras = 4, kRays = 4;
  std::array<std::array<float, kRays>, kCameras> of{};

  // Sigma by such a row of factors.
  static float Sigma(const std::array<float, kRays>& of_rays, int rays, float scale_mm, float growth_mm);
};

// Frames that sigma was fitted to, and which share of their vertices' errors is within one and two sigma.
struct SigmaCheck {
  int frames = 0;
  double within_one = 0, within_two = 0;
  // How unlikely the errors are by their sigmas, mean of log(sigma) + ratio^2 / 2 with ratios up to 6: by
  // which the numbers of ray_driver.cpp were chosen. Not kept in files.
  double loss = 0;
};

// Mean errors of driven meshes, in mm: of the same frames without the net and with it.
struct NetGain {
  int frames = 0;
  double before_mm = 0, after_mm = 0;
};

// Factors of a T-shirt before simulated cameras, for garments of which too little is known: what
// `accuracy_drive` prints for the data set shirt-drive-12.
SigmaScale TypicalSigmaScale();

}  // namespace weft
