// Ground truth on disk: <truth>/<frame>/mesh.ply and <truth>/<frame>/<camera>.csv.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "simulation/view_truth.h"

namespace weft {

// Columns kind,row,col,x_px,y_px,pitch_px,facing_deg,visible,scoreable,vertex; kind is `center` or `corner`,
// pixels to 1e-4.
std::string ViewTruthToCsv(const ViewTruth& truth);

// InvalidArgument names source_name and line.
absl::StatusOr<ViewTruth> ParseViewTruth(std::string_view csv, std::string camera_id,
                                         const std::string& source_name);

// Writes a frame's folder (made where it is missing).
absl::Status WriteFrameTruth(const std::string& folder, const FrameTruth& truth);
// Views are ordered by camera id. InvalidArgument or NotFound names the file.
absl::StatusOr<FrameTruth> ReadFrameTruth(const std::string& folder);

// Names of the frames below a truth folder, in the order of dumps. NotFound when there are none.
absl::StatusOr<std::vector<std::string>> ListTruthFrames(const std::string& truth_folder);

}  // namespace weft
