// Poses of cameras in YAML and JSON.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/rig/camera_model.h"

namespace weft {

// Sets rotation and translation of `camera`, in the unit of the file, from one of
// - R and T, or what else they are called: rotation_matrix and translation_vector, rvec and tvec. R has 9
//   numbers, or 3 of Rodrigues where its name does not say matrix;
// - a matrix 3x4 or 4x4 [R | T] that is called extrinsic_matrix or camera_from_world, or, then inverted,
//   world_from_camera.
// A camera without such stays where it is. What ROS tells of rectification is no pose, and remarked where it
// turns. InvalidArgument: half a pose, two of them, or a field that is a pose by its name and cannot be read.
absl::Status SetYamlPose(const YAML::Node& fields, CameraModel& camera, std::vector<std::string>& remarks);

}  // namespace weft
