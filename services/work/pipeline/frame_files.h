// What a frame's folder gets when the frame was registered, and what killed writers left there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/frame_stages.h"

namespace weft {

// Replaces the files of the frame. An older report is removed first, and the new one, which lists all
// other files, is written last. A mesh of an earlier run is removed if the frame has none now. Everything
// is on the disk when it returns. A folder that is removed meanwhile is created again. `out` is an
// absolute path without links.
absl::Status WriteFrame(const std::string& out, const RegistrationInputs& inputs, const FrameResult& frame);

// Whether a registration writes cloud.pcd.
inline constexpr char kPcdFormat[] = "pcd";
bool WantsPcd(const v1::RegistrationOptions& options);

// cloud.pcd follows from cloud.ply: writes it from there where report.options want it and it does not stand,
// removes it where they do not and it is damaged. Lists it in `report`.
absl::Status TidyCloudPcd(const FrameFolder& folder, v1::FrameReport& report);

// Replaces its meshes and its report alone, the report last; `mesh` is the frame's own, before neighbours had
// a say.
absl::Status ReplaceMeshes(const FrameFolder& folder, const RegistrationInputs& inputs,
                           const std::optional<RegisteredMesh>& mesh, v1::FrameReport report);

// Replaces everything by a report.
absl::Status WriteReportAlone(const std::string& out, v1::FrameReport report);

// Removes what killed writers left of the frames' files and of the job's own. Only while nobody writes them;
// what cannot be removed stays.
void RemoveTemporaryFiles(const std::string& out, const std::vector<std::string>& frames);

}  // namespace weft
