#include "services/server/daemon/work/results.h"

#include "absl/strings/str_cat.h"
#include "services/formats/files/confined_folder.h"
#include "services/server/rpc/result_names.h"

namespace weft {

absl::StatusOr<FilePieces> OpenResult(const v1::Job& job, const std::string& frame, v1::ResultKind kind,
                                      const StreamStart& start) {
  const std::string path = absl::StrCat(frame, frame.empty() ? "" : "/", ResultFileName(kind));
  const absl::StatusOr<ConfinedFolder> out = ConfinedFolder::Open(job.spec().out());
  absl::StatusOr<FilePieces> pieces = out.ok() ? FilePieces::Open(*out, path, start) : out.status();
  if (absl::IsNotFound(pieces.status())) {
    return absl::NotFoundError(absl::StrCat("job ", job.id(), frame.empty() ? "" : ", frame ", frame, ": no ",
                                            ResultFileName(kind), "; is it finished?"));
  }
  if (absl::IsFailedPrecondition(pieces.status()))
    return absl::PermissionDeniedError(pieces.status().message());
  return pieces;
}

}  // namespace weft
