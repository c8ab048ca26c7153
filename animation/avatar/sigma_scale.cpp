#include "animation/avatar/sigma_scale.h"

#include <algorithm>
#include <cmath>

namespace weft {

float SigmaScale::Sigma(const std::array<float, kRays>& of_rays, int rays, float scale_mm, float growth_mm) {
  const float among_rays_mm = of_rays[std::clamp(rays, 1, kRays - 1)] * scale_mm;
  return rays > 0 ? among_rays_mm : std::hypot(among_rays_mm, of_rays[0] * growth_mm);
}

SigmaScale TypicalSigmaScale() {
  SigmaScale out;
  out.of[0] = {11.5f, 21.4f, 21.4f, 21.4f};
  out.of[1] = {15.3f, 5.9f, 0.4f, 0.4f};
  out.of[2] = {14.0f, 6.7f, 0.4f, 0.4f};
  out.of[3] = {13.0f, 9.6f, 0.5f, 0.4f};
  return out;
}

}  // namespace weft
