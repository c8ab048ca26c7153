// The text format of the paper's rig. Per camera: an id line, K (3 lines), k1 k2 p1 p2 k3 (1 line), [R|t]
// camera_from_world in mm (3 lines), an empty line.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

// Parses the text of a KRT file; all cameras get the given image size, which the format does not carry.
// Comments from # on are skipped; numbers may have commas, semicolons and brackets between them.
// InvalidArgument names `source_name`, the line and what was expected there.
absl::StatusOr<Rig> ParseKrt(std::string_view text, const std::string& source_name, int width_px,
                             int height_px);

// The same text from a rig, every digit kept. InvalidArgument: a camera with more than five distortion
// coefficients, or an id with a space or slash.
absl::StatusOr<std::string> FormatKrt(const Rig& rig);

}  // namespace weft
