// rig.json.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/rig.h"

namespace weft {

// Parses rig.json; a file that holds `cameras` alone is complete. InvalidArgument names the file, the camera
// and the field: missing numbers, invalid cameras, or a `hash` that does not fit the cameras.
absl::StatusOr<Rig> ParseRig(std::string_view json, const std::string& source_name);
absl::StatusOr<Rig> ReadRig(const std::string& path);

// Every digit is kept: the rig read back has the same content hash. `provenance` may stay empty.
absl::Status WriteRig(const std::string& path, const Rig& rig, const std::string& provenance = "");

}  // namespace weft
