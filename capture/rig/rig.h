// A rig: the calibrated cameras of a studio.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "capture/rig/camera_model.h"

namespace weft {

struct Rig {
  std::string id;
  std::vector<CameraModel> cameras;

  // Every camera valid, ids unique, at least one camera. InvalidArgument names the camera and the field.
  absl::Status Validate() const;

  // Index of the camera with this id, -1 if there is none.
  int IndexOf(std::string_view camera_id) const;

  // 16 hex digits over every number and id that changes a projection; the same for a rig read back from disk.
  std::string ContentHash() const;
};

}  // namespace weft
