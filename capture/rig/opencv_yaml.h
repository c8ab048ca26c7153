// Rigs as OpenCV's YAML: a sequence `cameras` of maps with camera_name, image_width, image_height,
// camera_matrix (3x3), distortion_coefficients (1x4 to 1x8), R (3x3) and T (3x1, mm), camera_from_world.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

// Also reads the file of OpenCV's calibration program for one camera, with the same names at the top.
// Without R and T the camera is at the world's origin; without a name it is `camera0`. InvalidArgument
// names file, camera and field.
absl::StatusOr<Rig> ParseOpenCvYaml(std::string_view text, const std::string& source_name);

// Every digit is kept.
absl::StatusOr<std::string> FormatOpenCvYaml(const Rig& rig);

}  // namespace weft
