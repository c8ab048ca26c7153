#include "services/server/daemon/work/results.h"

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/frame_meshes.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/server/rpc/result_names.h"

namespace weft {

namespace {

// The file of a mesh by the frame's report, which is untrusted; as it is called where there is no report.
absl::StatusOr<std::string> MeshFileOf(const ConfinedFolder& out, const v1::FetchResultRequest& request) {
  const absl::StatusOr<ConfinedFolder> folder = out.Child(request.frame(), ConfinedFolder::IfMissing::kFail);
  const absl::StatusOr<std::string> json =
      folder.ok() ? folder->Read(FileName(FrameFile::kReport)) : folder.status();
  v1::FrameReport report;
  if (!json.ok() || !ParseJson(*json, request.frame(), report).ok())
    return MeshFileName(request.mesh().empty() ? kGarmentMesh : request.mesh());
  WEFT_ASSIGN_OR_RETURN(const std::string name, ChooseMesh({&report, 1}, request.mesh()));
  return MeshFileName(name);
}

}  // namespace

absl::StatusOr<FilePieces> OpenResult(const v1::Job& job, const v1::FetchResultRequest& request) {
  const std::string& frame = request.frame();
  const bool is_mesh = request.kind() == v1::RESULT_KIND_MESH;
  std::string file = request.mesh().empty() ? ResultFileName(request.kind()) : MeshFileName(request.mesh());
  const absl::StatusOr<ConfinedFolder> out = ConfinedFolder::Open(job.spec().out());
  const auto open = [&]() -> absl::StatusOr<FilePieces> {
    if (!out.ok()) return out.status();
    const std::string path = absl::StrCat(frame, frame.empty() ? "" : "/", file);
    return FilePieces::Open(*out, path, {request.offset(), request.version()});
  };
  absl::StatusOr<FilePieces> pieces = open();
  if (absl::IsNotFound(pieces.status()) && is_mesh) {
    const absl::StatusOr<std::string> named = out.ok() ? MeshFileOf(*out, request) : out.status();
    if (!named.ok()) {
      const absl::Status& why = named.status();
      return absl::Status(why.code(), absl::StrCat("job ", job.id(), ", frame ", frame, ": ", why.message()));
    }
    if (*named != file) file = *named, pieces = open();
  }
  if (absl::IsNotFound(pieces.status())) {
    return absl::NotFoundError(absl::StrCat("job ", job.id(), frame.empty() ? "" : ", frame ", frame, ": no ",
                                            file, "; is it finished?"));
  }
  if (absl::IsFailedPrecondition(pieces.status()))
    return absl::PermissionDeniedError(pieces.status().message());
  return pieces;
}

}  // namespace weft
