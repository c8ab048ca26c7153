// From a scene and a camera to the picture that the camera would take.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/camera_model.h"
#include "capture/frame.h"
#include "simulation/studio_scene.h"

namespace weft {

// Linear light, [height][width][3].
struct LinearImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> rgb;

  const float* at(int x, int y) const { return &rgb[3 * (static_cast<size_t>(y) * width_px + x)]; }
  float* at(int x, int y) { return &rgb[3 * (static_cast<size_t>(y) * width_px + x)]; }
};

struct SensorOptions {
  int samples_per_axis = 2;            // rays per pixel and axis, spread evenly over the pixel's area
  double point_spread_sigma_px = 0.8;  // lens and fabric softness, Gaussian
  double exposure = 1.35;              // linear value 1 / exposure is white
  double gamma = 2.2;                  // of the 8-bit values; 1 for a linear camera
  double full_well_electrons = 9000;   // electrons at white; photon noise follows
  double read_noise_electrons = 14;
  bool noise = true;
  std::optional<PixelFormat> mosaic;  // a Bayer format, for raw pictures
  uint64_t seed = 1;                  // of the noise; camera and frame are mixed in

  absl::Status Validate() const;
};

// Rays through the full lens model, averaged over each pixel. Parallel over rows of the picture in the
// calling thread's TBB arena, the same bytes at any thread count. Pixels where the lens model has no inverse
// show the backdrop of the optical axis.
absl::StatusOr<LinearImage> TraceView(const StudioScene& scene, const CameraModel& camera,
                                      int samples_per_axis);

// Gaussian blur; the border is repeated outwards. sigma 0 leaves the picture as it is.
void BlurImage(double sigma_px, LinearImage* image);

// Exposure, photon and read noise, gamma, mosaic, 8 bits. The noise of a pixel depends on seed, camera id,
// frame number and place only.
Frame DevelopImage(const LinearImage& image, const SensorOptions& options, const std::string& camera_id,
                   int64_t frame_number);

// The three steps in order.
absl::StatusOr<Frame> RenderView(const StudioScene& scene, const CameraModel& camera,
                                 const SensorOptions& options, int64_t frame_number);

}  // namespace weft
