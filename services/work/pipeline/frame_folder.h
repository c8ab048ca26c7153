// The folder of one frame's results: reads its report, and is the only place that writes one.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_meshes.h"
#include "services/formats/files/frame_paths.h"
#include "weft/v1/report.pb.h"

namespace weft {

// FrameReport.format_version of what is written now.
inline constexpr int kReportFormat = 1;

// report.json lists all other files with their checksums, so a frame is complete once the report that lists
// them is committed. Thread safety: const access; one writer at a time (result_lock.h).
class FrameFolder {
 public:
  // `out` is an absolute path without links; kMake makes it, too. Errors of ConfinedFolder.
  static absl::StatusOr<FrameFolder> Open(const std::string& out, const std::string& frame,
                                          ConfinedFolder::IfMissing missing);
  explicit FrameFolder(ConfinedFolder folder) : folder_(std::move(folder)) {}

  const std::string& path() const { return folder_.path(); }
  // For readers, valid while this object lives.
  std::string PathOf(FrameFile file) const { return folder_.At(FileName(file)); }
  // A message about PathOf(...) as people call the file.
  absl::Status InWords(const absl::Status& status) const { return folder_.InWords(status); }

  // NotFound: no report, a damaged one, or one of an older format. MeshesOf of it is no error.
  absl::StatusOr<v1::FrameReport> Report() const;
  // What is wrong with a file by report.files, e.g. "mesh.ply is missing"; empty when nothing. Not listed and
  // not there is right.
  std::string Check(FrameFile file, const v1::FrameReport& report) const;
  // The same for all files: the first problem.
  std::string CheckAll(const v1::FrameReport& report) const;
  // Everything written and removed so far is on the disk.
  absl::Status Sync() const { return folder_.Sync(); }

  // Writes the file, which is given as a path, and lists it in the report.
  using Writer = std::function<absl::Status(const std::string& path)>;
  absl::Status Put(FrameFile file, const Writer& write, v1::FrameReport& report) const;
  // Removes the file and its entry in the report.
  absl::Status Drop(FrameFile file, v1::FrameReport& report) const;
  // The same of a mesh, in place of one of its name. InvalidArgument: it is no name.
  absl::Status PutMesh(const std::string& name, size_t vertices, const std::vector<Face>& faces,
                       const Writer& write, v1::FrameReport& report) const;
  absl::Status DropMesh(const std::string& name, v1::FrameReport& report) const;
  // Removes all files, the report first.
  absl::Status Clear() const;
  // Writes report.json.
  absl::Status Commit(v1::FrameReport report) const;

 private:
  std::string CheckNamed(const std::string& name, const v1::FrameReport& report) const;
  absl::Status List(const std::string& name, v1::FrameReport& report) const;

  ConfinedFolder folder_;
};

// Whether the report lists the file.
bool Lists(const v1::FrameReport& report, FrameFile file);

}  // namespace weft
