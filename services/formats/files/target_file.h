// target.json: the boards and scale bars that a rig is calibrated with.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "capture/calibration/target.h"

namespace weft {

// InvalidArgument names the file, the board and the field.
absl::StatusOr<CalibrationTarget> ReadTarget(const std::string& path);
absl::Status WriteTarget(const std::string& path, const CalibrationTarget& target);

}  // namespace weft
