// Ground truth on disk: <truth>/<frame>/mesh.ply and <truth>/<frame>/<camera>.truth.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "simulation/view_truth.h"

namespace weft {

// The bytes of a <camera>.truth file: 21 a node, pixels to 1e-4, pitch to 1/256 px, angles to 0.01 degrees.
std::string EncodeViewTruth(const ViewTruth& truth);

// InvalidArgument names source_name and what is wrong.
absl::StatusOr<ViewTruth> DecodeViewTruth(std::string_view bytes, std::string camera_id,
                                          const std::string& source_name);

// Writes a frame's folder (made where it is missing).
absl::Status WriteFrameTruth(const std::string& folder, const FrameTruth& truth);
// Views are ordered by camera id. InvalidArgument or NotFound names the file.
absl::StatusOr<FrameTruth> ReadFrameTruth(const std::string& folder);

// Names of the frames below a truth folder, in the order of dumps. NotFound when there are none.
absl::StatusOr<std::vector<std::string>> ListTruthFrames(const std::string& truth_folder);

}  // namespace weft
