// Rigs as Kalibr writes them: camchain.yaml.
#pragma once

#include <yaml-cpp/yaml.h>

#include "absl/status/statusor.h"
#include "capture/rig/foreign_rig.h"

namespace weft {

bool IsKalibr(const YAML::Node& root);

// cam0, cam1, ..., each with its pose from the one before, in metres. InvalidArgument names camera and field.
absl::StatusOr<ForeignRig> ReadKalibr(const YAML::Node& root);

}  // namespace weft
