#include "absl/strings/str_cat.h"
#include "capture/camera/gige_camera.h"

namespace weft {

absl::Status GigeCameraOptions::Validate() const {
  if (id.empty() || device.empty())
    return absl::InvalidArgumentError("a GigE Vision camera needs an id and a device");
  if (buffers < 2)
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": buffers must be at least 2"));
  if (!(fps >= 0))
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": fps must not be negative"));
  if (clock_interval_ms < 0 || ptp_wait_ms < 0 || retention_ms <= 0)
    return absl::InvalidArgumentError(absl::StrCat("camera ", id, ": waits must not be negative"));
  for (const std::string& feature : features) {
    if (feature.find('=') == std::string::npos || feature.front() == '=')
      return absl::InvalidArgumentError(
          absl::StrCat("camera ", id, ": feature \"", feature, "\" is not of the form Name=value"));
  }
  return absl::OkStatus();
}

}  // namespace weft
