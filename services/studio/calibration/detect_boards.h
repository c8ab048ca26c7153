// Boards in all images of a dump.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/calibration/checks.h"
#include "capture/calibration/tag_detection.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"

namespace weft {

// The cameras of a dump with the sizes of their images and nothing else known: a rig to open the dump with.
// Reads the header of an image of each camera. Errors of the dump; InvalidArgument: no images.
absl::StatusOr<Rig> CamerasOfDump(const std::string& folder);

struct BoardDetection {
  CalibrationViews views;
  std::vector<CameraSightings> sightings;  // [cameras]
  std::vector<std::string> warnings;       // of the source, and images that could not be read
};

// Looks at every image of these frames (positions in the source). Cameras without any tag are looked at once
// more with left and right exchanged. `on_image` (may be empty): images done and all, from any thread.
// Parallel in the calling thread's TBB arena, the same at any thread count.
absl::StatusOr<BoardDetection> DetectBoards(const FrameSource& source, const Rig& cameras,
                                            const CalibrationTarget& target,
                                            const TagDetectionOptions& options,
                                            const std::vector<size_t>& frames,
                                            const std::function<void(size_t, size_t)>& on_image = {});

}  // namespace weft
