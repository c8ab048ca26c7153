// The frames' reports of a job, from the folder of its results.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

// <out_folder>/<frame>/report.json of the frames that the job was asked for, in their order. What is left out
// is listed in `notes`: files that are missing or broken, frames of other inputs or of other jobs. Errors:
// a folder that cannot be listed.
absl::StatusOr<std::vector<v1::FrameReport>> ReadJobFrames(const std::string& out_folder, const v1::Job& job,
                                                           std::vector<std::string>& notes);

// Frames that the job was asked for and whose folder has a report or a mesh, but which are not among
// `reports` as ReadJobFrames reads them: lost, damaged, or of other inputs.
absl::StatusOr<std::vector<std::string>> FramesWithoutReport(const std::string& out_folder,
                                                             const v1::Job& job,
                                                             const std::vector<v1::FrameReport>& reports);

}  // namespace weft
