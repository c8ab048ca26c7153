// The files of one frame: <out>/<frame>/.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/files/confined_folder.h"
#include "services/pipeline/frame_stages.h"

namespace weft {

// FrameReport.format_version of what is written now.
inline constexpr int kReportFormat = 1;

// The folder of a frame. `out` is an absolute path without links; kMake makes it, too. Errors of
// ConfinedFolder.
absl::StatusOr<ConfinedFolder> OpenFrameFolder(const std::string& out, const std::string& frame,
                                               ConfinedFolder::IfMissing missing);

// Replaces the files of the frame. An older report goes first and the new one, which lists all other files,
// comes last; a mesh of an earlier run does not survive a frame that now has none. All of it is on the disk
// when it returns. A folder that is removed meanwhile is made again.
absl::Status WriteFrame(const std::string& out, const RegistrationInputs& inputs, const FrameResult& frame);

// The same for a frame that has nothing but a report.
absl::Status WriteReportAlone(const std::string& out, v1::FrameReport report);

// Replaces the report; `files` of it is what its writer listed.
absl::Status WriteReport(const ConfinedFolder& folder, const v1::FrameReport& report);

// Lists the file as it is now in report.files. NotFound: it is not there.
absl::Status ListFile(const ConfinedFolder& folder, const std::string& name, v1::FrameReport& report);
void UnlistFile(const std::string& name, v1::FrameReport& report);

// What is wrong with the file by report.files, e.g. "mesh.ply is missing"; empty when nothing.
std::string CheckFile(const ConfinedFolder& folder, const std::string& name, const v1::FrameReport& report);
// The same for all files of the frame: listed ones are as they were written, others are not there.
std::string CheckFiles(const ConfinedFolder& folder, const v1::FrameReport& report);

// The report in `folder`. NotFound: none, or of an older format.
absl::StatusOr<v1::FrameReport> ReadReport(const ConfinedFolder& folder);

// Removes what killed writers left of the frames' files and of the job's own. Only while nobody writes them;
// what cannot be removed stays.
void RemoveTemporaryFiles(const std::string& out, const std::vector<std::string>& frames);

}  // namespace weft
