// What a job came to: good, usable or bad, why, and what to do.
#pragma once

#include <string>
#include <vector>

#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Of a job that ended and its frames' reports. What explains the others comes first: cells that were hardly
// decoded (another board), rays that hardly meet (another rig), then frames without a mesh, images that lack,
// cameras that moved, coverage.
v1::Verdict AssessJob(const v1::Job& job, const std::vector<v1::FrameReport>& frames);

// The same with the reports that stand in the folder of the job's results; those that cannot be read are left
// out.
v1::Verdict AssessJobFolder(const std::string& out_folder, const v1::Job& job);

}  // namespace weft
