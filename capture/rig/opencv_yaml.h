// Rigs as OpenCV's files, and cameras as ROS and Kalibr write them.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/rig/foreign_rig.h"

namespace weft {

// YAML or JSON; XML is refused with the remedy:
// - a sequence `cameras` of maps with camera_name, image_width, image_height, camera_matrix (3x3),
//   distortion_coefficients (4 to 14), R (3x3) and T (3x1, mm), camera_from_world;
// - the file of OpenCV's calibration program for one camera, with the same names at the top;
// - camera_info of ROS, as camera_calibration writes it or as `ros2 topic echo` prints it;
// - camchain.yaml of Kalibr: cam0, cam1, ..., each with its pose from the one before, in metres.
// `distortion_model` and `fisheye_model` are followed: fisheye lenses are fitted (FitLens). Without R and T a
// camera is at the world's origin; without a name it is `camera0`. InvalidArgument names file, camera and
// field, also for lens models that Weft does not have.
absl::StatusOr<ForeignRig> ParseOpenCvYaml(std::string_view text, const std::string& source_name);

// OpenCV's YAML. Every digit is kept.
absl::StatusOr<std::string> FormatOpenCvYaml(const Rig& rig);

}  // namespace weft
