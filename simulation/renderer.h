// From a scene and a camera to the picture that the camera would take.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "capture/rig/camera_model.h"
#include "simulation/lens.h"
#include "simulation/sensor.h"
#include "simulation/studio_scene.h"
#include "simulation/view_tracer.h"

namespace weft {

struct CameraOptions {
  TraceOptions tracing;
  LensOptions lens;
  SensorOptions sensor;

  absl::Status Validate() const;
};

// TraceView, the lens, DevelopImage. What varies from camera to camera follows from the sensor's seed and the
// camera's id; defocus and fall-off come before the point spread, as in a lens.
absl::StatusOr<Picture> RenderView(const StudioScene& scene, const CameraModel& camera,
                                   const CameraOptions& options, int64_t frame_number);

}  // namespace weft
