// Files of a job's results, for clients.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "services/server/daemon/calls/file_stream.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Opens the file, whatever is exchanged for links meanwhile. `frame` must be one of the job's. NotFound: it
// does not exist (yet). PermissionDenied: a link, or no file; nothing in the job's folder leads out of it.
// Otherwise errors of FilePieces::Open.
absl::StatusOr<FilePieces> OpenResult(const v1::Job& job, const std::string& frame, v1::ResultKind kind,
                                      const StreamStart& start);

}  // namespace weft
