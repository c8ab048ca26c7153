// The light that falls on a camera's sensor through a perfect lens.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/camera_model.h"
#include "simulation/lens.h"
#include "simulation/studio_scene.h"

namespace weft {

struct TraceOptions {
  int samples = 4;  // per pixel, of the print; a pixel at an outline has at least 16 rays

  absl::Status Validate() const;
};

struct TracedView {
  LinearImage image;
  std::vector<float> depth_mm;  // [height][width], along the optical axis; infinite in the room behind
};

// Each pixel is the mean over its area and over the scene's exposure. One ray is cast through the middle of
// each pixel; where the surface goes on evenly around it, the samples look the print up on the face that was
// hit, elsewhere (outlines, folds, seams) every sample is a ray. Rays go through the full lens model; between
// the points of a grid of 4 pixels it is interpolated, which with real lenses is within a thousandth of a
// pixel. Pixels where the lens model has no inverse show the backdrop of the optical axis.
//
// Parallel over tiles of the picture in the calling thread's TBB arena, the same bytes at any thread count.
absl::StatusOr<TracedView> TraceView(const StudioScene& scene, const CameraModel& camera,
                                     const TraceOptions& options = {});

}  // namespace weft
