// What a job came to: good, usable or bad, why, and what to do.
#pragma once

#include <string>
#include <vector>

#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Verdict of a job that ended, from its frames' reports. Root causes come first: few decoded cells
// (another board), then inconsistent rays (another rig). Frames without a mesh, missing images, cameras
// that moved and coverage follow.
v1::Verdict AssessJob(const v1::Job& job, const std::vector<v1::FrameReport>& frames);

// The same with the reports that stand in the folder of the job's results; those that cannot be read are left
// out.
v1::Verdict AssessJobFolder(const std::string& out_folder, const v1::Job& job);

}  // namespace weft
