// rig.json.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

// Parses rig.json; a file that holds `cameras` alone is complete. InvalidArgument names the file, the camera
// and the field: missing numbers, invalid cameras, or a `hash` that does not fit the cameras.
absl::StatusOr<Rig> ParseRig(std::string_view json, const std::string& source_name);
absl::StatusOr<Rig> ReadRig(const std::string& path);

// What a calibration knows of a rig besides its numbers.
struct CalibratedCamera {
  std::array<double, 15>
      sigmas{};  // fx fy cx cy k1 k2 p1 p2 k3, rotation about the camera's axes (rad), centre (mm)
  double projection_sigma_px = 0;
  double corner_sigma_px = 0;
  double rms_px = 0;
  int views = 0;
  int corners = 0;
};
struct CalibrationRecord {
  int version = 1;
  std::string replaces;  // hash of the rig before, empty for the first
  std::string calibrated_utc;
  double rms_px = 0;
  Eigen::Vector3d stage_low_mm = Eigen::Vector3d::Zero(), stage_high_mm = Eigen::Vector3d::Zero();
  std::vector<CalibratedCamera> cameras;  // as the rig's
};

// Every digit is kept: the rig read back has the same content hash. `provenance` may stay empty,
// `calibration` null.
absl::Status WriteRig(const std::string& path, const Rig& rig, const std::string& provenance = "",
                      const CalibrationRecord* calibration = nullptr);

// What the file says of its calibration; empty where it says nothing. Errors of ReadRig; InvalidArgument
// where a camera has no sigmas or too few.
absl::StatusOr<std::optional<CalibrationRecord>> ReadCalibrationRecord(const std::string& path);

// What the calibration leaves of doubt about a known point in each camera's image
// (CameraSigmas.projection_px), px; empty where the file knows no sigmas. Errors of ReadCalibrationRecord.
absl::StatusOr<std::vector<double>> ReadCameraSigmas(const std::string& path);

}  // namespace weft
