// The light that falls on a camera's sensor through a perfect lens.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/camera_model.h"
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

// Each pixel is the mean over its area and over the scene's exposure. What the middle of each pixel shows is
// found by drawing the faces tile by tile; where the surface goes on evenly around it, the samples look the
// print up on the face that is seen there, elsewhere (outlines, folds, seams) each sample finds its own face,
// at its own moment. Rays go through the full lens model, within a thousandth of a pixel (TileDirections).
// Pixels where the lens model has no inverse show the backdrop of the optical axis.
//
// Parallel over tiles of the picture in the calling thread's TBB arena, the same bytes at any thread count.
absl::StatusOr<TracedView> TraceView(const StudioScene& scene, const CameraModel& camera,
                                     const TraceOptions& options = {});

}  // namespace weft
