// Pictures of what the cameras of a take see.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/camera.pb.h"

namespace weft {

struct TakeLookOptions {
  std::string camera_id;  // empty: all
  int width_px = 640;     // at most
  std::string frame;      // of this frame set alone, by its name (FrameNameOf); empty: of the newest
};

// Of the newest frame set in which a camera has a frame, also while the take is recorded. A camera whose
// frame cannot be read has a problem instead of a picture. NotFound: no take, or no such camera or frame.
// FailedPrecondition: no frame set yet.
absl::StatusOr<std::vector<v1::CameraLook>> LookAtTake(const std::string& folder,
                                                       const TakeLookOptions& options);

}  // namespace weft
