// What a lens does to a picture besides its geometry: point spread, defocus, fall-off towards the corners.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "capture/rig/camera_model.h"

namespace weft {

// Linear light, [height][width][3].
struct LinearImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> rgb;

  const float* at(int x, int y) const { return &rgb[3 * (static_cast<size_t>(y) * width_px + x)]; }
  float* at(int x, int y) { return &rgb[3 * (static_cast<size_t>(y) * width_px + x)]; }
};

struct LensOptions {
  double point_spread_sigma_px = 0.7;  // Gaussian
  double point_spread_variation = 0;   // of a camera's sigma, relative, each way
  double f_number = 0;                 // aperture; 0 for a pinhole, with everything in focus
  double focus_distance_mm = 0;        // along the optical axis; 0 for the middle of what is filmed
  double focus_error_mm = 0;           // of a camera's focus, each way
  double pixel_pitch_um = 3.45;        // of the sensor
  double vignetting = 0;               // share of the light lost in the corners

  absl::Status Validate() const;
};

// Radius in pixels of the circle of confusion of a point at `depth_mm` when the lens is focused at
// `focus_mm`. Thin lens: R = f^2 |depth - focus| / (2 N depth (focus - f)), with f = focal_px times the
// pixel pitch.
double DefocusRadiusPx(const LensOptions& options, double focal_px, double focus_mm, double depth_mm);

// Gaussian; the border is repeated outwards. Sigma 0 leaves the picture as it is.
void BlurGaussian(double sigma_px, LinearImage* image);

// Discs with a radius of each pixel's own, `radius_px` [height][width]: interpolated between pictures blurred
// with radii half a pixel apart, so right where neighbouring radii are alike.
void BlurDefocus(const std::vector<float>& radius_px, LinearImage* image);

// Light falls off with the square of the distance from the centre of the picture.
void Vignette(double share, LinearImage* image);

}  // namespace weft
