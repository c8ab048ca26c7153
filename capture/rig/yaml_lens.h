// Lenses of cameras in YAML and JSON.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "capture/rig/camera_model.h"

namespace weft {

// A lens by the name that OpenCV, ROS or Kalibr gives its model, and its coefficients; an empty name is
// OpenCV's model. The other numbers of `camera` are set. Fisheye lenses are fitted (FitLens), which is
// remarked. InvalidArgument: a model without a counterpart, or another number of coefficients than it has.
absl::Status SetYamlLens(const std::string& model, const std::vector<double>& coefficients,
                         CameraModel& camera, std::vector<std::string>& remarks);

// By the fields distortion_coefficients, and distortion_model, camera_model and what else names a lens.
// InvalidArgument names the field, also where two of them contradict each other.
absl::Status SetYamlDistortion(const YAML::Node& fields, CameraModel& camera,
                               std::vector<std::string>& remarks);

}  // namespace weft
