// Pictures as a camera without lens distortion would have taken them.
#pragma once

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"
#include "capture/rig/rig.h"

namespace weft {

// The camera at the same place without distortion and with square pixels: focal length fx along both axes.
// Other programs have no other ones.
CameraModel WithoutDistortion(const CameraModel& camera);
Rig WithoutDistortion(const Rig& rig);

// A picture in colour of `camera`, as WithoutDistortion(camera) sees it: of the same size, interpolated
// between four pixels, black where the lens saw nothing. InvalidArgument: no picture in colour of the
// camera's size; Validate() of the camera.
absl::StatusOr<Frame> UndistortPicture(const Frame& rgb, const CameraModel& camera);

}  // namespace weft
