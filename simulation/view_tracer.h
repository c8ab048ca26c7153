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

// Each pixel is the mean over its area and over the scene's exposure. The face at the centre of each pixel
// is found by rasterising the faces tile by tile. Where the surface is smooth around it, all samples look
// up the print on that face. Elsewhere (outlines, folds, seams) each sample finds its own face, at its own
// moment. Rays go through the full lens model, within a thousandth of a pixel (TileDirections). Pixels
// where the lens model has no inverse show the backdrop of the optical axis.
//
// Parallel over tiles of the picture in the calling thread's TBB arena, the same bytes at any thread count.
absl::StatusOr<TracedView> TraceView(const StudioScene& scene, const CameraModel& camera,
                                     const TraceOptions& options = {});

}  // namespace weft
